#pragma once

#include <Eigen/Core>

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

/// Heavy tails: a row that the others, without its siblings, explain badly where the samples lie
/// counts less, so that a few strange materials do not widen the prior of the usual ones. The
/// weights are those of a t distribution fitted by iterated reweighting, cut at 1. Uniform below
/// a dozen materials, where nobody knows what is strange.
///
/// Source  Lange, Little, Taylor, "Robust Statistical Modeling Using the t Distribution", Journal
///         of the American Statistical Association 84, 1989, section 3.
RowPrior heavy_tailed_prior(const Basis& basis, const NormalEquations& equations);

}  // namespace gonio::basis::detail
