#include "gonio/design/exchange.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "candidate_gate.h"
#include "exchange_pool.h"
#include "search_support.h"

namespace gonio::design {
namespace {

// From level to level this many times the candidates, and few designs go on.
constexpr std::size_t kLevelFactor = 8;
constexpr int kKeptBetween = 3;
// How the time splits between the starts and the rest, for the progress shown.
constexpr double kStartShare = 0.4;

std::vector<std::uint32_t> allowed_cells(const CandidateGate& gate) {
  std::vector<std::uint32_t> allowed;
  for (std::size_t i = 0; i < gate.size(); ++i) {
    const auto cell = static_cast<std::uint32_t>(i);
    if (gate.allowed(cell)) allowed.push_back(cell);
  }
  return allowed;
}

/// An even selection of the allowed cells and those already chosen.
std::vector<std::uint32_t> selection_with(const std::vector<std::uint32_t>& allowed,
                                          std::size_t wanted, const std::vector<Trial>& chosen) {
  if (allowed.size() <= wanted) return allowed;
  std::vector<std::uint32_t> selection = even_selection(allowed, wanted);
  for (const Trial& trial : chosen) {
    selection.insert(selection.end(), trial.cells.begin(), trial.cells.end());
  }
  std::sort(selection.begin(), selection.end());
  selection.erase(std::unique(selection.begin(), selection.end()), selection.end());
  return selection;
}

basis::RowMajorMatrixXf rows_of(const basis::RowMajorMatrixXf& rows,
                                const std::vector<std::uint32_t>& cells) {
  basis::RowMajorMatrixXf selected(static_cast<Eigen::Index>(cells.size()), rows.cols());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    selected.row(static_cast<Eigen::Index>(i)) = rows.row(cells[i]);
  }
  return selected;
}

}  // namespace

void ExchangeOptions::validate() const {
  if (sample_count < 1) {
    throw std::invalid_argument("design: sample_count is " + std::to_string(sample_count) +
                                ", expected at least 1");
  }
  if (starts < 1) throw std::invalid_argument("design: starts must be at least 1");
  if (polished < 1) throw std::invalid_argument("design: polished must be at least 1");
  if (start_candidates < 1) {
    throw std::invalid_argument("design: start_candidates must be at least 1");
  }
  if (!(eta > 0.0) || !std::isfinite(eta)) {
    throw std::invalid_argument("design: eta is " + std::to_string(eta) +
                                ", expected above 0 and finite");
  }
}

Design exchange(const basis::RowMajorMatrixXf& rows, const Eigen::MatrixXd& importance,
                const Candidates& candidates, const ExchangeOptions& options,
                const ProgressCallback& progress, const std::stop_token& stop) {
  options.validate();
  if (importance.rows() != rows.cols() || importance.cols() != rows.cols()) {
    throw std::invalid_argument("design: the importance matrix is " +
                                std::to_string(importance.rows()) + " x " +
                                std::to_string(importance.cols()) + ", the rows have " +
                                std::to_string(rows.cols()) + " components");
  }
  CandidateGate gate(candidates, static_cast<std::size_t>(rows.rows()));
  const std::vector<std::uint32_t> allowed = allowed_cells(gate);
  const auto count = static_cast<std::size_t>(options.sample_count);
  const auto polished = static_cast<std::size_t>(options.polished);

  Design design;
  SearchProgress state{0.0, std::numeric_limits<double>::infinity()};
  const auto tell = [&](double fraction, double value) {
    state.fraction = std::max(state.fraction, fraction);
    state.best = std::min(state.best, value);
    if (progress) progress(state);
  };
  const auto share_of = [&](std::size_t tried) {
    return std::min(1.0, static_cast<double>(tried) / (kUsualSweeps * options.sample_count));
  };

  // A selection with room to choose from, however few samples are wanted; a larger one when the
  // gate refuses too much of it.
  std::vector<Trial> trials;
  std::size_t wanted = std::max(options.start_candidates, 16 * count);
  for (;; wanted *= kLevelFactor) {
    const std::vector<std::uint32_t> selection = selection_with(allowed, wanted, {});
    const basis::RowMajorMatrixXf selected = rows_of(rows, selection);
    ExchangePool pool(selected, selection, importance, candidates, options, gate);
    Trial first = pool.greedy();
    if (first.cells.size() < count) {
      if (wanted < allowed.size()) continue;
      throw std::invalid_argument("design: only " + std::to_string(first.cells.size()) +
                                  " usable candidates for " + std::to_string(count) + " samples");
    }
    trials.push_back(std::move(first));
    for (int start = 0; start < options.starts; ++start) {
      if (start > 0) {
        if (stop.stop_requested()) break;
        trials.push_back(pool.random_start(static_cast<std::uint64_t>(start)));
      }
      pool.exchange(trials.back(), stop, [&](std::size_t tried, double value) {
        tell(kStartShare * (start + share_of(tried)) / options.starts, value);
      });
      design.starts += trials.back().finished ? 1 : 0;
    }
    break;
  }

  // The same on more and more candidates, each level from where the one before has ended.
  while (wanted < allowed.size()) {
    wanted *= kLevelFactor;
    const bool last = wanted >= allowed.size();
    keep_best(trials, last ? polished : std::max<std::size_t>(polished, kKeptBetween));
    if (stop.stop_requested()) break;
    const std::vector<std::uint32_t> selection =
        last ? std::vector<std::uint32_t>() : selection_with(allowed, wanted, trials);
    const basis::RowMajorMatrixXf selected = rows_of(rows, selection);
    ExchangePool pool(last ? rows : selected, selection, importance, candidates, options, gate);
    for (std::size_t i = 0; i < trials.size(); ++i) {
      if (last) pool.descend(trials[i], stop);
      pool.exchange(trials[i], stop, [&](std::size_t tried, double value) {
        const double part =
            (static_cast<double>(i) + share_of(tried)) / static_cast<double>(trials.size());
        tell(kStartShare + 0.5 * (1.0 - kStartShare) * (last ? 1.0 + part : part), value);
      });
    }
  }

  keep_best(trials, 1);
  design.cells = trials[0].cells;
  design.value = trials[0].value;
  design.exchanges = trials[0].exchanges;
  design.finished = trials[0].finished && !stop.stop_requested();
  if (design.finished) tell(1.0, design.value);
  return design;
}

}  // namespace gonio::design
