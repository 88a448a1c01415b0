#pragma once

#include <Eigen/Core>
#include <vector>

#include "gonio/basis/basis.h"
#include "normal_equations.h"

namespace gonio::basis::detail {

/// How much each training row counts in the prior: c ~ N(mean, sum_t weight_t v_t v_t^T / mass),
/// v_t = u_t - mean.
struct RowPrior {
  Eigen::VectorXd weight;  ///< m, above 0, at most 1
  Eigen::VectorXd mean;    ///< k, weighted mean of the rows of U
  double mass = 0.0;       ///< sum of the weights
};

/// All rows alike: the prior c ~ N(0, I/m) of Basis.
RowPrior uniform_prior(const Basis& basis);

/// Mean over each group's rows of y^T (R + A C A^T)^-1 y, y = A (u - mean) with the mean of the
/// prior without the group and C its covariance (about the mean of all) without it.
std::vector<double> left_out_chi2(const Basis& basis, const NormalEquations& equations,
                                  const RowPrior& prior,
                                  const std::vector<std::vector<Eigen::Index>>& groups);

/// Heavy tails: a row that the others, without its siblings, explain badly where the samples lie
/// counts less, so that a few strange materials do not widen the prior of the usual ones: weight
/// min(1, usual / chi^2), three rounds of reweighting. Uniform below kFewestGroups groups, where
/// nobody knows what is strange.
///
/// Source  R. A. Maronna, "Robust M-Estimators of Multivariate Location and Scatter", Annals of
///         Statistics 4(1), 1976: Huber's weights, here against the median of left-out chi^2.
RowPrior heavy_tailed_prior(const Basis& basis, const NormalEquations& equations);

}  // namespace gonio::basis::detail
