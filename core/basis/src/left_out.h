#pragma once

#include <Eigen/Core>
#include <array>

#include "gonio/basis/basis.h"
#include "gonio/basis/reconstruct.h"
#include "noise_model.h"
#include "normal_equations.h"

namespace gonio::basis::detail {

/// What the samples' own noise becomes on its way through the linear solve.
struct NoisePropagation {
  Eigen::MatrixXd right_covariance;  ///< k x k, of NormalEquations::right
  /// Expected noise^T R^-1 noise = tr(R^-1 N), before the prior's share. N is the covariance of the
  /// stated noise: R without the model's variance.
  double innovation = 0.0;
  /// Of the noise over the samples, weighted as in `likeness` (nepers^2).
  double mean_square = 0.0;
};

/// `model_variance`  The part of MappedSamples::variance that is no noise.
NoisePropagation propagate_noise(const SampleRows& rows, const MappedSamples& mapped,
                                 double model_variance);

/// A channel as compare_with_training() needs it.
struct SeenChannel {
  const SampleRows& rows;
  const MappedSamples& mapped;
  const NormalEquations& equations;
};

/// Compares a measurement with the training materials, and each of these with the others as if it
/// had been measured by the same samples. Fills `likeness` and `noise_covariance` of a fit that has
/// its `left_out_residuals`.
void compare_with_training(const Basis& basis, const std::array<SeenChannel, 3>& channels,
                           double model_variance, Fit& fit);

}  // namespace gonio::basis::detail
