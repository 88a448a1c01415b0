#pragma once

#include "gonio/acquisition/session.h"

namespace gonio::acquisition {

/// Everything that can be known to be wrong before anything moves. Throws std::invalid_argument
/// with one line naming the device, axis or direction, what was found and what is expected.
void check_before_motion(const DeviceSet& devices, const instrument::Instrument& instrument,
                         const MeasurementPlan& plan, const SessionOptions& options);

/// Where the white is measured: 45:0 (theta_i = 45, theta_o = 0 deg), or the nearest reachable
/// direction to it. Throws std::invalid_argument when the rig reaches none.
rig::PoseSolution white_pose(const rig::Inverse& inverse);

}  // namespace gonio::acquisition
