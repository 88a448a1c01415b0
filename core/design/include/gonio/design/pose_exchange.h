#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include "gonio/basis/basis.h"
#include "gonio/design/candidates.h"
#include "gonio/design/patch_geometry.h"
#include "gonio/design/pose_grid.h"
#include "gonio/design/pose_information.h"
#include "gonio/design/search.h"

namespace gonio::design {

/// Poses a search may choose, by the direction their centre sees.
///
/// `poses`    All of them on a grid (pose_grid()).
/// `allowed`  Tells of any direction whether it may be taken, for the refinement between the grid's
///            poses; empty: the result stays on the grid. Called from many threads.
/// `accept`   As Candidates::accept: asked only about poses that would be chosen next, from the
///            calling thread, for rigs whose inverse kinematics is numeric. Empty accepts all.
struct PoseCandidates {
  std::vector<brdf::HalfDiff> poses;
  AllowedPose allowed;
  std::function<bool(const brdf::HalfDiff&)> accept;
};

struct PoseDesignOptions {
  int pose_count = 10;
  PoseNoise noise;
  int starts = 12;  ///< >= 1; the first is greedy, the others begin at random
  std::size_t start_candidates = 1 << 12;  ///< the starts search an even selection this large
  int polished = 1;                        ///< how many of them go on over all poses
  double refine_step_deg = 0.5;            ///< between the grid's poses; 0: not refined
  std::uint64_t seed = 1;

  /// Throws std::invalid_argument naming the field.
  void validate() const;
};

/// Poses chosen for all that their frames show.
struct PoseDesign {
  std::vector<brdf::HalfDiff> poses;  ///< in the order they were chosen; phi_h = 0
  double value = 0.0;                 ///< expected_error() of them, nepers^2
  bool finished = true;               ///< false: stopped on request, the best so far
  int starts = 0;                     ///< that ran to their end
  int exchanges = 0;                  ///< swaps that led to it
};

/// Chooses poses by what their patches of directions tell together: minimises expected_error(),
/// tr(K M) with M = (1 + sum_b A_b^T A_b)^-1. Greedy and random starts on an even selection of the
/// candidates, each exchanged (drop one, take the best in its place) until no exchange helps; the
/// best of them again among their neighbours, the best of these over all candidates; last, over
/// finer positions around each chosen one.
///
/// `importance`  k x k, positive semidefinite: importance_matrix(), or any other Gram matrix of
///               what an error of the coefficients costs.
/// Patches       A patch is small: what it shows is nearly a quadratic function of the position, so
///               it is searched by the six strongest combinations of its sub-samples. The value is
///               that of all.
/// Memory        Per candidate 2.1 kB at k = 80, for a patch.
/// Stop          Between trials: the best whole design so far, at the least the greedy one of the
///               selection.
/// Determinism   The same bytes for the same seed, whatever the number of threads.
/// Errors        std::invalid_argument: shapes that do not fit, options, fewer usable candidates
///               than poses.
/// Source        docs/adr/0003-pose-design.md.
PoseDesign choose_poses(const basis::Basis& basis, const Eigen::MatrixXd& importance,
                        const PoseCandidates& candidates, const PatchGeometry& patch,
                        const PoseDesignOptions& options, const ProgressCallback& progress = {},
                        const std::stop_token& stop = {});

}  // namespace gonio::design
