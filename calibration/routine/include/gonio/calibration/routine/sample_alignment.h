#pragma once

#include <functional>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/acquisition/session.h"
#include "gonio/calibration/geometry/zero_offsets.h"
#include "gonio/calibration/routine/settings.h"
#include "gonio/instrument/instrument.h"

namespace gonio::calibration::routine {

/// How a mounted sample lies, from its own highlight.
struct SampleAlignment {
  geometry::MountNormal normal;
  std::vector<geometry::Peak> peaks;  ///< one per angle of the lamp arm
};

/// Scans azimuth and tilt (7 x 7) about the highlight of the mounted glossy sample at two angles of
/// the lamp arm. Homes the axes first.
///
/// `known`   The calibrated instrument; its rig's normal is where the search begins, within 4 deg.
/// Errors    StepRefused: no highlight stands out (a matte sample: align it by its seat), or it
/// lies
///           outside the search. devices::DeviceError as the devices.
SampleAlignment align_sample(
    const acquisition::DeviceSet& devices, const instrument::Instrument& known,
    const RoutineSettings& settings,
    const std::function<void(const std::string& what, double fraction)>& progress,
    std::stop_token stop);

}  // namespace gonio::calibration::routine
