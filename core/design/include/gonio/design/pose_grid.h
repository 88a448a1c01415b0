#pragma once

#include <functional>
#include <vector>

#include "gonio/brdf/directions.h"

namespace gonio::design {

/// Tells of any direction whether a pose may have it. May be called from many threads.
using AllowedPose = std::function<bool(const brdf::HalfDiff&)>;

/// Every direction of an even grid that is above the horizon and allowed: `step_deg` apart in
/// theta_d and phi_d and in 90 sqrt(theta_h / 90 deg), the lattice's own spacing.
/// `allowed`  Empty allows all.
/// Throws     std::invalid_argument unless the step is in [0.5, 45] deg.
std::vector<brdf::HalfDiff> pose_grid(double step_deg, const AllowedPose& allowed);

/// The pose and those up to `reach` steps to either side in each of the three, above the horizon
/// and allowed; phi_d in [0, 180) by reciprocity.
std::vector<brdf::HalfDiff> poses_around(const brdf::HalfDiff& pose, double step_deg, int reach,
                                         const AllowedPose& allowed);

}  // namespace gonio::design
