#pragma once

#include <cstdint>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/basis/basis.h"
#include "gonio/console/console.h"
#include "gonio/design/patch_geometry.h"
#include "gonio/design/pose_information.h"
#include "gonio/rig/kinematics.h"

namespace gonio::cli {

struct PoseRequest {
  int pose_count = 10;
  design::PatchGeometry patch;
  design::PoseNoise noise;
  std::uint64_t seed = 1;
};

/// Chooses poses for all that their frames show; with a rig only such as it reaches. A stop ends
/// the search with the best so far. Throws UsageError when fewer are reachable than asked for.
std::vector<brdf::HalfDiff> choose_poses(const Console& console, const basis::Basis& basis,
                                         const Eigen::MatrixXd& importance,
                                         const rig::Inverse* inverse, const PoseRequest& request,
                                         const std::stop_token& stop = {});

/// What these poses would tell with other samples and from other distances: a small table.
std::string sample_size_text(const basis::Basis& basis, const Eigen::MatrixXd& importance,
                             const std::vector<brdf::HalfDiff>& poses, const PoseRequest& request);

}  // namespace gonio::cli
