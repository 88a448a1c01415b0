#include "command.h"
#include "gonio/devices/resettable_alarm.h"
#include "hands_on.h"

namespace gonio::cli {
namespace {

struct HomeOptions : HandsOnOptions {
  bool reset_alarms = false;
};

int home(Context& context, const HomeOptions& options) {
  HandsOnOptions homing = options;
  homing.home = true;
  HandsOn rig(context, homing, Parts::axes_and_lamp);
  if (options.reset_alarms) {
    for (devices::RotationStage* stage : rig.devices().stages) {
      auto* alarm = dynamic_cast<devices::ResettableAlarm*>(stage);
      if (alarm != nullptr) alarm->reset_alarm();
    }
  }
  rig.make_ready();
  rig.print_joints();
  rig.finish();
  return kSuccess;
}

}  // namespace

void add_home(const Command& root) {
  auto options = std::make_shared<HomeOptions>();
  const Command command =
      root.add("home", "Home all axes; say where they stand", "gonio home rigs/lab_example.toml");
  add_hands_on_options(command, *options, false);
  command.flag("--reset-alarms", options->reset_alarms,
               "Clear the drives' alarms first; you have looked what they are about");
  command.on_call(options, home);
}

}  // namespace gonio::cli
