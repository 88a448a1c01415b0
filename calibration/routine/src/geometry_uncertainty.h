#pragma once

#include <string>
#include <vector>

#include "gonio/calibration/result/calibrated_rig.h"
#include "gonio/calibration/routine/findings.h"

namespace gonio::calibration::routine {

// Stage, lamp and zeros were found as one homing has left the axes. To what was seen after another
// one, all zeros are off by the difference of two homings. `homing` is Observations::homing.

/// findings.stage with that in its covariance.
geometry::StageAxes stage_after(const Findings& findings, int homing);
/// findings.lamp_arm with that in its covariance.
geometry::LampArm lamp_after(const Findings& findings, int homing);
/// findings.zeros->one_sigma_rigs, and one for each axis that was homed since.
std::vector<CalibratedRig> one_sigma_rigs_after(const Findings& findings, int homing);

}  // namespace gonio::calibration::routine
