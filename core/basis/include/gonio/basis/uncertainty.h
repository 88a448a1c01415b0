#pragma once

#include <Eigen/Core>
#include <span>

#include "gonio/basis/basis.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/brdf/brdf_table.h"

namespace gonio::basis {

/// How far a reconstruction may be off, cell by cell, in the mapped domain where it was made.
///
/// sigma   Root of two parts: the samples' noise carried through the solve, and the errors that the
///         same measurement would have made on the training materials most like this one, each
///         without its own group's rows in the basis. The second part is seen, not assumed: it
///         holds shrinkage, cut-off components and what the directions missed alike.
/// factors How many sigmas the limits stand away. No 1 and 1.96: errors of materials have longer
///         tails than a Gauss curve, so these are the quantiles found when every training material
///         is predicted from the others in the same way.
struct Uncertainty {
  Eigen::MatrixXf sigma;  ///< p x 3, nepers of f w + eps
  double factor_68 = 1.0;
  double factor_95 = 2.0;
};

/// Uncertainty of a fit by Method::automatic or Method::kernel.
/// Throws   std::invalid_argument for a fit of another method or basis, or a basis of fewer than 3
///          materials.
/// Threads  Uses all; the same bytes with any number. About as long as expand() takes ten times.
Uncertainty uncertainty(const Basis& basis, const Fit& fit);

/// The whole BRDF with every cell moved by `factor` sigmas (negative: the lower limit); clamped at
/// 0 as expand() does.
brdf::BrdfTable limit(const Basis& basis, const Fit& fit, const Uncertainty& uncertainty,
                      double factor);

namespace detail {

/// Share that each training row has in the local error of something at mean square distance
/// `distance` (m values) of them; sums to 1. A negative distance means "not this one".
Eigen::VectorXd likeness_weights(const Eigen::Ref<const Eigen::VectorXd>& distance);

}  // namespace detail

}  // namespace gonio::basis
