#include "command.h"
#include "hands_on.h"

namespace gonio::cli {
namespace {

struct JogOptions : HandsOnOptions {
  std::string axis;
  double by_deg = 0.0;
};

int jog(Context& context, const JogOptions& options) {
  HandsOn rig(context, options, Parts::axes_and_lamp);
  const std::size_t axis = rig.axis(options.axis);
  rig.make_ready();
  rig::Joints target = rig.guarded().joints();
  target[axis] += Angle::from_degrees(options.by_deg);
  rig.move_to(target);
  rig.print_joints();
  rig.finish();
  return kSuccess;
}

}  // namespace

void add_jog(const Command& root) {
  auto options = std::make_shared<JogOptions>();
  const Command command =
      root.add("jog", "Turn one axis by some degrees", "gonio jog rigs/lab_example.toml tilt -0.5");
  add_hands_on_options(command, *options, true);
  command.text("AXIS", options->axis, "Name in the rig file", Need::required);
  command.number("DEG", options->by_deg, -3600.0, 3600.0, "How far", Need::required);
  command.on_call(options, jog);
}

}  // namespace gonio::cli
