#include "standing_capture.h"

#include <fmt/format.h>

#include <algorithm>

#include "gonio/devices/clock.h"
#include "gonio/rig/paths.h"

namespace gonio::acquisition {

devices::Frame capture_standing(GuardedDevices& devices, std::chrono::nanoseconds exposure,
                                FrameRecord& record, const std::function<void()>& meanwhile) {
  // Nothing was sent to move since: what stood where it was read stands there still, and if not,
  // the reading after the exposure tells.
  const rig::Joints before = devices.last_reading();
  devices::Frame frame = devices.capture(exposure, meanwhile);
  const rig::Joints after = devices.read_joints();
  record.joints.clear();
  record.joints_spread.clear();
  for (std::size_t i = 0; i < before.size(); ++i) {
    // Against the arrival, not only over this exposure: a slow creep adds up over a bracket.
    const Angle arrived = devices.joints()[i];
    const Angle astray = std::max(abs(before[i] - arrived), abs(after[i] - arrived));
    if (astray > rig::kPlanningMargin) {
      throw devices::DeviceError(
          devices::DeviceErrc::Timeout, devices.devices().stages[i]->name(),
          fmt::format("stood at {:.4f} deg, went from {:.4f} to {:.4f} deg during an exposure of "
                      "{:g} s, expected it within {:g} deg",
                      arrived.degrees(), before[i].degrees(), after[i].degrees(),
                      devices::to_seconds(exposure), rig::kPlanningMargin.degrees()));
    }
    record.joints.push_back((before[i] + after[i]) / 2.0);
    record.joints_spread.push_back(abs(after[i] - before[i]) / 2.0);
  }
  return frame;
}

}  // namespace gonio::acquisition
