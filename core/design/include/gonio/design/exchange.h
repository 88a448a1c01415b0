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
  int starts = 12;   ///< >= 1; the first is greedy, the others begin at random
  std::size_t start_candidates = 1 << 14;  ///< the starts search an even selection this large
  int polished = 1;                        ///< how many of them end on all cells
  std::uint64_t seed = 1;

  /// Throws std::invalid_argument naming the field.
  void validate() const;
};

/// Chooses rows: greedy and random starts on an even selection of the candidates, each exchanged
/// (drop one, take the best in its place) until no exchange helps; the best of them again on eight
/// times as many candidates, and so on; the last on all. The result is a fixpoint over all allowed
/// and accepted cells: no swap of one lowers the criterion by more than a millionth.
///
/// `rows`        p x k (Basis::components). Read, not copied, but for the selection.
/// `importance`  k x k, of all cells (importance_matrix()).
/// Time          One pass over `rows` per trial; limited by memory bandwidth.
/// Memory        Besides `rows`: 30 bytes per cell (50 for xu_squared) and an eighth of `rows`.
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
                const ProgressCallback& progress = {}, const std::stop_token& stop = {});

}  // namespace gonio::design
