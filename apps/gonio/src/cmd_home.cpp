#include "command.h"
#include "hands_on.h"

namespace gonio::cli {
namespace {

int home(Context& context, const HandsOnOptions& options) {
  HandsOnOptions homing = options;
  homing.home = true;
  HandsOn rig(context, homing, Parts::axes_and_lamp);
  rig.make_ready();
  rig.print_joints();
  rig.finish();
  return kSuccess;
}

}  // namespace

void add_home(const Command& root) {
  auto options = std::make_shared<HandsOnOptions>();
  const Command command =
      root.add("home", "Home all axes; say where they stand", "gonio home rigs/lab.toml");
  add_hands_on_options(command, *options, false);
  command.on_call(options, home);
}

}  // namespace gonio::cli
