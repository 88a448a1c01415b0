#pragma once

#include <Eigen/Core>
#include <span>

#include "gonio/basis/basis.h"
#include "gonio/design/patch_geometry.h"

namespace gonio::design {

/// Errors a pose's sub-samples are expected to have, nepers (k = 1): R = diag(independent^2 +
/// model_eta/m) + common^2 1 1^T.
struct PoseNoise {
  double independent = 0.02;  ///< of each sub-sample
  double common = 0.02;       ///< the same for all of a pose: white, lamp
  double model_eta = 1.0;     ///< what the basis cannot express, as ReconstructOptions::model_eta

  /// Throws std::invalid_argument: not finite, negative, no independent part at all.
  void validate() const;
};

/// What one pose tells: rows A_b (sub-samples x k) such that A_b^T A_b = A^T R^-1 A / m is its
/// information about the coefficients in units of their prior, M = (1 + sum_b A_b^T A_b)^-1.
///
/// Errors  std::invalid_argument: a centre below the horizon.
Eigen::MatrixXd pose_rows(const basis::BasisRows& rows, const brdf::HalfDiff& centre,
                          const PatchGeometry& patch, const PoseNoise& noise);

/// Expected importance-weighted mean square error, nepers^2, of a measurement in these poses:
/// tr(K M) / m, from scratch in double. Of the prior alone for no poses.
double expected_error(const basis::BasisRows& rows, const Eigen::MatrixXd& importance,
                      std::span<const brdf::HalfDiff> poses, const PatchGeometry& patch,
                      const PoseNoise& noise);

}  // namespace gonio::design
