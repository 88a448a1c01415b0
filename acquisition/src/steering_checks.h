#pragma once

#include "gonio/acquisition/measurement_plan.h"

namespace gonio::acquisition {

/// What the pre-run check asks of a plan's points: each direction once, poses within the limits.
/// Throws PreflightError.
void check_points(const MeasurementPlan& plan, const rig::RigDescription& rig);

}  // namespace gonio::acquisition
