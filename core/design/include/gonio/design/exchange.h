#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <stop_token>

#include "gonio/basis/basis.h"
#include "gonio/design/candidates.h"
#include "gonio/design/criteria.h"
#include "gonio/design/search.h"

namespace gonio::design {

struct ExchangeOptions {
  int sample_count = 10;
  Criterion criterion = Criterion::bayes_a;
  double eta = 0.3;  ///< m sigma^2 per sample, > 0
  int starts = 6;    ///< >= 1; the first is greedy, the others begin at random
  std::size_t start_candidates = 1 << 16;  ///< the starts search an even selection this large
  int polished = 2;                        ///< how many of them go on over all cells
  std::uint64_t seed = 1;

  /// Throws std::invalid_argument naming the field.
  void validate() const;
};

/// Chooses rows: greedy and random starts on an even selection of the candidates, each exchanged
/// (drop one, take the best in its place) until no exchange helps; the best of them then again over
/// all candidates. The result is a fixpoint over all allowed and accepted cells.
///
/// `rows`        p x k (Basis::components). Read, not copied, but for the selection.
/// `importance`  k x k, of all cells (importance_matrix()).
/// Time          One pass over `rows` per trial; limited by memory bandwidth.
/// Memory        Besides `rows`: 25 bytes per cell (50 for xu_squared) and the selection.
/// Stop          Between trials: the best whole design so far is returned, at the least the greedy
///               one of the selection.
/// Determinism   The same bytes for the same seed, whatever the number of threads. Ties go to the
///               lower cell.
/// Errors        std::invalid_argument: shapes that do not fit, options, fewer usable candidates
///               than samples.
/// Source        Fedorov, "Theory of Optimal Experiments", 1972; Cook and Nachtsheim, "A Comparison
///               of Algorithms for Constructing Exact D-Optimal Designs", Technometrics 22(3),
///               1980.
Design exchange(const basis::RowMajorMatrixXf& rows, const Eigen::MatrixXd& importance,
                const Candidates& candidates, const ExchangeOptions& options,
                const ProgressCallback& progress = {}, std::stop_token stop = {});

}  // namespace gonio::design
