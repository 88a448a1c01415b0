#pragma once

#include <span>
#include <utility>

#include "gonio/basis/basis.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/basis/uncertainty.h"
#include "gonio/brdf/brdf_table.h"

/// How true bands and verdicts are, measured where the truth is known.
namespace gonio::quality {

/// Share of the cells and channels whose true value lies inside the limits, weighted by solid angle
/// and both cosines, over cells that are valid in the truth.
struct Coverage {
  double in_68 = 0.0;
  double in_95 = 0.0;
};
Coverage coverage(const brdf::BrdfTable& truth, const basis::Basis& basis, const basis::Fit& fit,
                  const basis::Uncertainty& bands);

/// Probability that a failure has a lower score than a success, ties counting half: 0.5 when the
/// score knows nothing, 1 when it tells all. `results` are (score, failed). NaN without both kinds.
double area_under_roc(std::span<const std::pair<double, bool>> results);

}  // namespace gonio::quality
