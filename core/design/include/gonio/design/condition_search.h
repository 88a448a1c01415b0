#pragma once

#include <cstdint>
#include <stop_token>

#include "gonio/basis/basis.h"
#include "gonio/design/candidates.h"
#include "gonio/design/search.h"

namespace gonio::design {

struct ConditionSearchOptions {
  int sample_count = 10;
  int random_cells = 500;  ///< tried for each direction after the first
  std::uint64_t seed = 1;

  /// Throws std::invalid_argument naming the field.
  void validate() const;
};

/// The published search, kept for comparison: first the candidate with the largest row norm, then
/// one direction after another, the best of 500 random ones by the condition number of A (n rows,
/// the first `sample_count` columns), moved over the lattice in steps of 3 and then of 1 index in
/// theta_h, theta_d or phi_d while the condition number falls.
///
/// `rows`   p x k in the order of lattice::cells_above_horizon(). p must be basis_cell_count() and
///          k at least 1; with k < sample_count all columns are used.
/// Value    The condition number.
/// Errors   std::invalid_argument as exchange().
/// Source   Nielsen, Jensen, Ramamoorthi, "On Optimal, Minimal BRDF Sampling for Reflectance
///          Acquisition", ACM TOG 34(6), 2015, section 5.
Design condition_search(const basis::RowMajorMatrixXf& rows, const Candidates& candidates,
                        const ConditionSearchOptions& options,
                        const ProgressCallback& progress = {}, const std::stop_token& stop = {});

}  // namespace gonio::design
