#include "command.h"
#include "hands_on.h"

namespace gonio::cli {
namespace {

int park(Context& context, const HandsOnOptions& options) {
  HandsOn rig(context, options, Parts::axes_and_lamp);
  rig.make_ready();
  rig.guarded().close_shutter();
  rig.move_to(rig.instrument().rig.home());
  rig.print_joints();
  rig.finish();
  return kSuccess;
}

}  // namespace

void add_park(const Command& root) {
  auto options = std::make_shared<HandsOnOptions>();
  const Command command = root.add("park", "Close the shutter, go to the home pose",
                                   "gonio park rigs/lab_example.toml");
  add_hands_on_options(command, *options, true);
  command.on_call(options, park);
}

}  // namespace gonio::cli
