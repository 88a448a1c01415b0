#pragma once

#include <functional>

#include "gonio/acquisition/guarded_devices.h"

namespace gonio::acquisition {

/// Exposes while the axes stand. The encoders are read before and after; `record` gets the mean of
/// the two readings as `joints` and half their difference as `joints_spread`. `meanwhile` as in
/// GuardedDevices::capture().
///
/// Errors   devices::DeviceError; Timeout naming the axis, where it arrived and what it read when
///          one is more than rig::kPlanningMargin from where it arrived: the frame is then none of
///          this pose.
devices::Frame capture_standing(GuardedDevices& devices, std::chrono::nanoseconds exposure,
                                FrameRecord& record, const std::function<void()>& meanwhile = {});

}  // namespace gonio::acquisition
