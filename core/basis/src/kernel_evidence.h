#pragma once

#include <Eigen/Core>
#include <array>
#include <functional>

#include "gonio/basis/basis.h"
#include "normal_equations.h"

namespace gonio::basis::detail {

/// Equations of the three channels.
using ChannelEquations = std::array<NormalEquations, 3>;

/// A solution and what is known about its errors.
struct Evidence {
  Eigen::MatrixXd coefficients;        ///< k x 3
  Eigen::MatrixXd left_out_residuals;  ///< m x k, see Fit
  double kernel_share = 0.0;
};

/// The kernel of usual strength alone.
Evidence single_kernel(const Basis& basis, const ChannelEquations& equations);

/// Kernels of several strengths (none among them) at several model noises, each weighed by how well
/// it predicts the training materials that look like the measured one from samples like these,
/// without their own rows and their siblings': the mean of ln |residual|^2 over them, likeness
/// falling with the distance of the samples. Nobody has to know the right strength: on ten patches
/// the mean was level with the best single candidate, on ten points 0.1 dB below it
/// (docs/results.md). All with heavy_tailed_prior().
///
/// `equations_at`  The equations when the model noise is as given (ReconstructOptions::model_eta).
/// Threads         Candidates are shared out; the same bytes with any number of threads.
Evidence weigh_kernels(const Basis& basis,
                       const std::function<ChannelEquations(double model_eta)>& equations_at,
                       double model_eta);

}  // namespace gonio::basis::detail
