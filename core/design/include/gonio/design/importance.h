#pragma once

#include <Eigen/Core>
#include <span>

#include "gonio/basis/basis.h"

namespace gonio::design {

/// How much an error in each cell matters when directions are chosen.
///
/// Blend    (1 - uniform_blend) solid angle x cosines + uniform_blend uniform; each part sums to 1
///          before they are mixed, so the blend is a share of the total importance. Ten per cent
///          of uniform weight halves the error at grazing angles for a few tenths of a decibel
///          (docs/results.md).
/// Source   Solid angle of a lattice cell times cos theta_i cos theta_o:
///          sin(th) sqrt(th) sin(td) cos(td) cos theta_i cos theta_o, sqrt(th) being the Jacobian
///          of the square-root spacing.
struct ImportanceOptions {
  double uniform_blend = 0.1;  ///< in [0, 1]
};

/// One weight per basis cell (lattice::cells_above_horizon()), all positive unless the blend is 0,
/// summing to 1. Throws std::invalid_argument for a blend outside [0, 1].
Eigen::VectorXf importance_weights(const ImportanceOptions& options = {});

/// K = Q^T W Q (k x k, symmetric): the importance-weighted mean square, over cells, of the error
/// that an error dc in the coefficients makes is dc^T K dc.
///
/// `rows`     p x k. `weights` p, not negative.
/// Errors     std::invalid_argument when the lengths differ.
/// Threads    Uses all; the same bytes with any number. About 0.1 s for p = 1.1 M, k = 80.
Eigen::MatrixXd importance_matrix(const basis::RowMajorMatrixXf& rows,
                                  const Eigen::VectorXf& weights);

}  // namespace gonio::design
