#pragma once

#include "bracket.h"

namespace gonio::acquisition {

/// Everything that can be known to be wrong before anything moves: options, devices against rig and
/// calibration, every point, the white in view, and a clear way along the whole itinerary.
/// Throws PreflightError.
void check_before_motion(const DeviceSet& devices, const instrument::Instrument& instrument,
                         const MeasurementPlan& plan, const SessionOptions& options);

/// Where the white is measured: 45:0 (theta_i = 45, theta_o = 0 deg), or the nearest reachable
/// direction to it. Throws PreflightError when the rig reaches none.
rig::Joints white_joints(const rig::RigDescription& rig);

/// The part of the image the white fills at these joints; empty when it is out of view.
Regions white_regions(const instrument::Instrument& instrument, const SessionOptions& options,
                      const rig::Joints& joints);

}  // namespace gonio::acquisition
