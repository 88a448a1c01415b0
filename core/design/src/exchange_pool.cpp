#include "exchange_pool.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "gonio/random/stream.h"
#include "lattice_moves.h"
#include "search_support.h"

namespace gonio::design {
namespace {

// Lattice indices a sample moves at once before all cells are looked at, and rounds of it.
constexpr std::array<int, 3> kDescentSteps = {4, 2, 1};
constexpr int kMostDescents = 60;

/// One figure per row of a pool, from one per cell.
std::vector<float> of_cells(const std::vector<float>& values,
                            const std::vector<std::uint32_t>& cells) {
  if (values.empty() || cells.empty()) return values;
  std::vector<float> selected(cells.size());
  std::transform(cells.begin(), cells.end(), selected.begin(),
                 [&](std::uint32_t cell) { return values[cell]; });
  return selected;
}

}  // namespace

ExchangePool::ExchangePool(const basis::RowMajorMatrixXf& rows, std::vector<std::uint32_t> cells,
                           const Eigen::MatrixXd& importance, const Candidates& candidates,
                           const ExchangeOptions& options, CandidateGate& gate)
    : rows_(rows),
      cells_(std::move(cells)),
      importance_(importance),
      candidates_(candidates),
      options_(options),
      gate_(gate),
      field_(rows, importance, options.criterion, options.eta, of_cells(candidates.noise, cells_),
             of_cells(candidates.penalty, cells_)),
      allowed_(field_.size()) {
  for (std::size_t i = 0; i < allowed_.size(); ++i) allowed_[i] = gate_.allowed(cell_of(i));
}

Trial ExchangePool::greedy() {
  Members members;
  std::vector<Change> added;
  field_.reset(open_after({}));
  while (members.size() < static_cast<std::size_t>(options_.sample_count)) {
    field_.scan(added, nullptr, allowed_, criterion_of(members));
    const std::size_t next = pick(members, field_.size());
    if (next == field_.size()) break;
    added = {adding(options_.criterion, row(next), open_after(members), importance_, eta_of(next))};
    members.push_back(next);
  }
  Trial trial;
  for (const std::size_t member : members) trial.cells.push_back(cell_of(member));
  trial.value = value_of(members);
  return trial;
}

Trial ExchangePool::random_start(std::uint64_t start) {
  random::Stream draw(random::make_key(options_.seed, "design.start", start));
  Members members;
  while (members.size() < static_cast<std::size_t>(options_.sample_count)) {
    const std::size_t next = draw.below(field_.size());
    if (std::find(members.begin(), members.end(), next) == members.end() && usable(next)) {
      members.push_back(next);
    }
  }
  Trial trial;
  for (const std::size_t member : members) trial.cells.push_back(cell_of(member));
  trial.value = value_of(members);
  return trial;
}

void ExchangePool::descend(Trial& trial, const std::stop_token& stop) {
  if (!cells_.empty() || field_.size() != basis_cell_count()) return;
  Members members(trial.cells.begin(), trial.cells.end());
  bool moved = true;
  for (int round = 0; moved && round < kMostDescents; ++round) {
    moved = false;
    for (std::size_t at = 0; at < members.size(); ++at) {
      if (stop.stop_requested()) return;
      std::vector<std::uint32_t> near;
      for (const int step : kDescentSteps) {
        for (const std::uint32_t cell : neighbours(trial.cells[at], step)) {
          if (allowed_[cell] != 0 &&
              std::find(members.begin(), members.end(), cell) == members.end()) {
            near.push_back(cell);
          }
        }
      }
      if (near.empty()) continue;
      Members others = members;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(at));
      basis::RowMajorMatrixXf rows(static_cast<Eigen::Index>(near.size()), rows_.cols());
      for (std::size_t i = 0; i < near.size(); ++i) {
        rows.row(static_cast<Eigen::Index>(i)) = rows_.row(near[i]);
      }
      CandidateField field(rows, importance_, options_.criterion, options_.eta,
                           of_cells(candidates_.noise, near), of_cells(candidates_.penalty, near));
      field.reset(open_after(others));
      field.scan({}, nullptr, std::vector<std::uint8_t>(near.size(), 1), criterion_of(others));
      const std::size_t best = near[field.best()];
      if (!usable(best)) continue;
      const std::size_t old = std::exchange(members[at], best);
      const double value = value_of(members);
      if (trial.value - value > kLeastImprovement * std::abs(trial.value)) {
        trial.value = value;
        trial.cells[at] = cell_of(best);
        ++trial.exchanges;
        moved = true;
      } else {
        members[at] = old;
      }
    }
  }
}

void ExchangePool::exchange(Trial& trial, const std::stop_token& stop, const TrialCallback& tell) {
  Members members;
  for (const std::uint32_t cell : trial.cells) members.push_back(row_of(cell));
  const std::size_t n = members.size();
  Eigen::MatrixXd open = open_after(members);
  field_.reset(open);
  trial.finished = false;
  std::vector<Change> pending;
  std::size_t tried = 0;
  for (std::size_t at = 0, unchanged = 0; unchanged < n; at = (at + 1) % n) {
    if (stop.stop_requested()) return;
    const std::size_t old = members[at];
    const Change drop = dropping(options_.criterion, row(old), open, importance_, eta_of(old));
    Members others = members;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(at));
    field_.scan(pending, &drop, allowed_, criterion_of(others));
    pending.clear();
    const std::size_t next = pick(members, at);
    bool better = false;
    if (next != field_.size() && next != old) {
      members[at] = next;
      const double value = value_of(members);
      better = trial.value - value > kLeastImprovement * std::abs(trial.value);
      if (better) {
        pending = {drop, adding(options_.criterion, row(next), open_after(others), importance_,
                                eta_of(next))};
        open = open_after(members);
        trial.value = value;
        trial.cells[at] = cell_of(next);
        ++trial.exchanges;
      } else {
        members[at] = old;
      }
    }
    unchanged = better ? 1 : unchanged + 1;
    tell(++tried, trial.value);
  }
  trial.finished = true;
}

std::uint32_t ExchangePool::cell_of(std::size_t at) const {
  return cells_.empty() ? static_cast<std::uint32_t>(at) : cells_[at];
}

std::size_t ExchangePool::row_of(std::uint32_t cell) const {
  if (cells_.empty()) return cell;
  return static_cast<std::size_t>(std::lower_bound(cells_.begin(), cells_.end(), cell) -
                                  cells_.begin());
}

Eigen::VectorXd ExchangePool::row(std::size_t at) const {
  return rows_.row(static_cast<Eigen::Index>(at)).transpose().cast<double>();
}

double ExchangePool::eta_of(std::size_t at) const {
  return candidates_.noise.empty()
             ? options_.eta
             : options_.eta + static_cast<double>(candidates_.noise[cell_of(at)]);
}

/// Rows to a common noise, so that one eta holds for all.
Eigen::MatrixXd ExchangePool::scaled_rows_of(const Members& members) const {
  Eigen::MatrixXd result(static_cast<Eigen::Index>(members.size()), rows_.cols());
  for (std::size_t i = 0; i < members.size(); ++i) {
    result.row(static_cast<Eigen::Index>(i)) =
        std::sqrt(options_.eta / eta_of(members[i])) * row(members[i]).transpose();
  }
  return result;
}

Eigen::MatrixXd ExchangePool::open_after(const Members& members) const {
  return open_share(scaled_rows_of(members), options_.eta);
}

double ExchangePool::criterion_of(const Members& members) const {
  return criterion_value(options_.criterion, scaled_rows_of(members), importance_, options_.eta);
}

double ExchangePool::value_of(const Members& members) const {
  const double value = criterion_of(members);
  if (candidates_.penalty.empty()) return value;
  double penalty = 0.0;
  for (const std::size_t member : members) {
    penalty += static_cast<double>(candidates_.penalty[cell_of(member)]);
  }
  return options_.criterion == Criterion::bayes_d ? value + penalty : value * std::exp(penalty);
}

bool ExchangePool::usable(std::size_t at) {
  if (allowed_[at] != 0 && gate_.accepted(cell_of(at))) return true;
  allowed_[at] = 0;
  return false;
}

/// The best of the last scan that may be taken for members[free] (size(): for none of them).
std::size_t ExchangePool::pick(const Members& members, std::size_t free) {
  for (;;) {
    const std::size_t next = field_.best();
    if (next == field_.size()) return next;
    const auto found = std::find(members.begin(), members.end(), next);
    const bool taken =
        found != members.end() && static_cast<std::size_t>(found - members.begin()) != free;
    if (!taken && usable(next)) return next;
    field_.dismiss(next);
  }
}

}  // namespace gonio::design
