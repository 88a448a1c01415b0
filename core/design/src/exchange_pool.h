#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include "candidate_field.h"
#include "candidate_gate.h"
#include "gonio/design/exchange.h"

namespace gonio::design {

/// A set of samples on its way to a design.
struct Trial {
  std::vector<std::uint32_t> cells;
  double value = 0.0;
  bool finished = true;  ///< no swap helps among the candidates of the last pool
  int exchanges = 0;
};

/// Called after each drop tried: how many so far, and the criterion.
using TrialCallback = std::function<void(std::size_t tried, double value)>;

/// Exchanges among some of the candidates, or all.
///
/// Threads  One; the work inside is shared out.
class ExchangePool {
 public:
  /// `rows`, `importance`, `candidates`, `options` and `gate` must outlive the pool.
  /// `cells`  The cell of each row, ascending; empty when row i is cell i.
  ExchangePool(const basis::RowMajorMatrixXf& rows, std::vector<std::uint32_t> cells,
               const Eigen::MatrixXd& importance, const Candidates& candidates,
               const ExchangeOptions& options, CandidateGate& gate);

  /// One after another, each the best next. Fewer than asked for when the pool has no more.
  Trial greedy();

  /// Drawn evenly from the pool, which must have enough usable candidates.
  Trial random_start(std::uint64_t start);

  /// Moves each sample over the lattice while that helps: cheap, and the exchange over all cells
  /// then has little left to do. Nothing for a pool of some cells, or of rows that are no lattice.
  void descend(Trial& trial, const std::stop_token& stop);

  /// Drops one after another and takes the best in its place until a whole round changes nothing,
  /// or until asked to stop. The trial's cells must be in the pool.
  void exchange(Trial& trial, const std::stop_token& stop, const TrialCallback& tell);

 private:
  using Members = std::vector<std::size_t>;  // row numbers

  std::uint32_t cell_of(std::size_t row) const;
  std::size_t row_of(std::uint32_t cell) const;
  Eigen::VectorXd row(std::size_t at) const;
  double eta_of(std::size_t at) const;
  Eigen::MatrixXd open_after(const Members& members) const;
  double criterion_of(const Members& members) const;
  double value_of(const Members& members) const;  ///< penalties included
  Eigen::MatrixXd scaled_rows_of(const Members& members) const;
  bool usable(std::size_t at);
  std::size_t pick(const Members& members, std::size_t free);

  const basis::RowMajorMatrixXf& rows_;
  std::vector<std::uint32_t> cells_;
  const Eigen::MatrixXd& importance_;
  const Candidates& candidates_;
  const ExchangeOptions& options_;
  CandidateGate& gate_;
  CandidateField field_;
  std::vector<std::uint8_t> allowed_;
};

}  // namespace gonio::design
