#pragma once

#include <span>
#include <string>
#include <vector>

#include "stage_geometry.h"

namespace gonio::calibration::geometry {

/// Where a search for the stage starts: from the boards' poses in front of the camera, closed form.
/// Which way the axes count comes out too, and is noted where it is not as nominal.
///
/// `used`     Which of the views to look at, their poses in `fitted`.
/// Errors     StepRefused: axes that move too little, turn at another rate or stand elsewhere than
///            nominal.
StageGeometry start_of_stage(const rig::RigDescription& nominal,
                             const instrument::CameraModel& camera,
                             std::span<const StageView> views,
                             const std::vector<FittedView>& fitted, const StageAxesOptions& options,
                             std::vector<std::string>& notes);

}  // namespace gonio::calibration::geometry
