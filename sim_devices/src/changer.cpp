#include "changer.h"

namespace gonio::sim {

using devices::DeviceErrc;
using devices::DeviceError;

void SimTargetChanger::mount(devices::Target target) {
  for (const auto& joint : joints_) {
    if (joint->settled_at() > clock_.now()) {
      throw DeviceError(DeviceErrc::Fault, name_, "an axis is moving");
    }
  }
  if (light_.lit() != SimLightSource::kDark) {
    throw DeviceError(DeviceErrc::Fault, name_, "the shutter is open");
  }
  if (target == mounted_) return;
  clock_.wait_until(clock_.now() + change_time_);
  mounted_ = target;
}

}  // namespace gonio::sim
