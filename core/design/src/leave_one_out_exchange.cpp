#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>
#include <stdexcept>
#include <string>

#include "candidate_gate.h"
#include "gonio/design/leave_one_out.h"
#include "gonio/parallel/parallel.h"
#include "gonio/random/stream.h"
#include "lattice_moves.h"
#include "leave_one_out_field.h"

namespace gonio::design {
namespace {

/// What a swap must lower J by: the tenth part of a hundredth of a decibel.
constexpr double kLeastGain = 1e-4;
constexpr std::array<int, 3> kRefinementSteps = {6, 2, 1};
constexpr int kMostMoves = 60;  // of one descent; the lattice is 90 indices wide
constexpr std::size_t kSweepBlock = 64;

struct Tried {
  std::uint32_t cell;
  double value;
};

/// One search: the design on its way and everything that stays.
class Search {
 public:
  Search(const basis::RowMajorMatrixXf& rows, const Eigen::MatrixXd& left_vectors,
         const Eigen::MatrixXd& importance, const Candidates& candidates,
         const LeaveOneOutOptions& options)
      : rows_(rows),
        left_vectors_(left_vectors),
        importance_(importance),
        candidates_(candidates),
        options_(options),
        gate_(candidates, static_cast<std::size_t>(rows.rows())),
        floor_(options.floor_share * importance.trace() /
               static_cast<double>(left_vectors.rows())) {}

  CandidateGate& gate() { return gate_; }

  double value_of(const std::vector<std::uint32_t>& cells) const {
    Eigen::MatrixXd chosen(static_cast<Eigen::Index>(cells.size()), rows_.cols());
    Eigen::VectorXd noise(chosen.rows());
    double penalty = 0.0;
    for (std::size_t i = 0; i < cells.size(); ++i) {
      chosen.row(static_cast<Eigen::Index>(i)) = rows_.row(cells[i]).cast<double>();
      noise[static_cast<Eigen::Index>(i)] = noise_of(cells[i]);
      penalty += penalty_of(cells[i]);
    }
    return leave_one_out_value(
               leave_one_out(chosen, left_vectors_, importance_, options_.eta, noise), importance_,
               options_.floor_share) +
           penalty;
  }

  /// The best found to take the place of cells[at]; cells[at] itself when nothing is.
  std::uint32_t best_for(const std::vector<std::uint32_t>& cells, std::size_t at, int sweep) {
    std::vector<std::uint32_t> others = cells;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(at));
    const LeaveOneOutField field = field_without(others);
    taken_ = others;

    std::vector<std::uint32_t> drawn = {cells[at]};
    random::Stream draw(random::make_key(options_.seed, "design.leave_one_out",
                                         static_cast<std::uint64_t>(sweep) * cells.size() + at));
    const std::uint64_t most = 20U * static_cast<std::uint64_t>(options_.random_cells);
    for (std::uint64_t i = 0; i < most && drawn.size() <= wanted_random(); ++i) {
      const auto cell = static_cast<std::uint32_t>(draw.below(gate_.size()));
      if (free(cell)) drawn.push_back(cell);
    }
    std::vector<Tried> found = values(field, drawn);
    const Tried present = found[0];
    std::sort(found.begin(), found.end(), before);
    std::vector<Tried> ends = {present};
    for (const Tried& next : found) {
      if (ends.size() > static_cast<std::size_t>(options_.descents)) break;
      if (next.cell != present.cell && gate_.accepted(next.cell)) ends.push_back(next);
    }
    descend(field, ends);
    std::sort(ends.begin(), ends.end(), before);
    return ends[0].cell;
  }

 private:
  static bool before(const Tried& a, const Tried& b) {
    return a.value != b.value ? a.value < b.value : a.cell < b.cell;
  }

  std::size_t wanted_random() const { return static_cast<std::size_t>(options_.random_cells); }
  double noise_of(std::uint32_t cell) const {
    return candidates_.noise.empty() ? 0.0 : static_cast<double>(candidates_.noise[cell]);
  }
  double penalty_of(std::uint32_t cell) const {
    return candidates_.penalty.empty()
               ? 0.0
               : static_cast<double>(candidates_.penalty[cell]) / std::numbers::ln10;
  }
  double scale_of(std::uint32_t cell) const {
    return std::sqrt(options_.eta / (options_.eta + noise_of(cell)));
  }
  double noise_share_of(std::uint32_t cell) const {
    return noise_of(cell) / (options_.eta + noise_of(cell));
  }
  bool free(std::uint32_t cell) const {
    return gate_.allowed(cell) && std::find(taken_.begin(), taken_.end(), cell) == taken_.end();
  }

  LeaveOneOutField field_without(const std::vector<std::uint32_t>& others) const {
    const auto count = static_cast<Eigen::Index>(others.size());
    Eigen::MatrixXd kept(count, rows_.cols());
    Eigen::VectorXd shares(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const std::uint32_t cell = others[static_cast<std::size_t>(i)];
      kept.row(i) = rows_.row(cell).cast<double>() * scale_of(cell);
      shares[i] = noise_share_of(cell);
    }
    return {kept, shares, left_vectors_, importance_, options_.eta, floor_};
  }

  std::vector<Tried> values(const LeaveOneOutField& field,
                            const std::vector<std::uint32_t>& cells) const {
    std::vector<Tried> result(cells.size());
    parallel::for_each_block(0, cells.size(), kSweepBlock, [&](std::size_t from, std::size_t to) {
      basis::RowMajorMatrixXf gathered(static_cast<Eigen::Index>(to - from), rows_.cols());
      std::array<float, kSweepBlock> shares{};
      std::array<double, kSweepBlock> found;
      for (std::size_t i = from; i < to; ++i) {
        gathered.row(static_cast<Eigen::Index>(i - from)) =
            rows_.row(cells[i]) * static_cast<float>(scale_of(cells[i]));
        shares[i - from] = static_cast<float>(noise_share_of(cells[i]));
      }
      field.values(gathered.data(), shares.data(), to - from, found.data());
      for (std::size_t i = from; i < to; ++i) {
        result[i] = {cells[i], found[i - from] + penalty_of(cells[i])};
      }
    });
    return result;
  }

  /// Follows each end over the lattice while it falls, all of them together.
  void descend(const LeaveOneOutField& field, std::vector<Tried>& ends) {
    std::vector<std::uint8_t> moving(ends.size(), 1);
    for (int move = 0; move < kMostMoves; ++move) {
      std::vector<std::uint32_t> cells;
      std::vector<std::size_t> owner;
      for (std::size_t i = 0; i < ends.size(); ++i) {
        if (moving[i] == 0) continue;
        for (const int step : kRefinementSteps) {
          for (const std::uint32_t cell : neighbours(ends[i].cell, step)) {
            if (!free(cell)) continue;
            cells.push_back(cell);
            owner.push_back(i);
          }
        }
      }
      if (cells.empty()) return;
      const std::vector<Tried> found = values(field, cells);
      std::vector<Tried> best = ends;
      for (std::size_t j = 0; j < found.size(); ++j) {
        if (before(found[j], best[owner[j]]) && gate_.accepted(found[j].cell)) {
          best[owner[j]] = found[j];
        }
      }
      for (std::size_t i = 0; i < ends.size(); ++i) {
        moving[i] = static_cast<std::uint8_t>(moving[i] != 0 && best[i].cell != ends[i].cell);
      }
      ends = std::move(best);
    }
  }

  const basis::RowMajorMatrixXf& rows_;
  const Eigen::MatrixXd& left_vectors_;
  const Eigen::MatrixXd& importance_;
  const Candidates& candidates_;
  const LeaveOneOutOptions& options_;
  CandidateGate gate_;
  double floor_;
  std::vector<std::uint32_t> taken_;
};

}  // namespace

void LeaveOneOutOptions::validate() const {
  const auto refuse = [](const std::string& what) {
    throw std::invalid_argument("design: leave one out: " + what);
  };
  if (!(eta > 0.0) || !std::isfinite(eta)) refuse("eta must be above 0 and finite");
  if (!(floor_share > 0.0 && floor_share < 1.0)) refuse("floor_share must lie between 0 and 1");
  if (random_cells < 1) refuse("random_cells must be at least 1");
  if (descents < 1) refuse("descents must be at least 1");
  if (sweeps < 1) refuse("sweeps must be at least 1");
}

Design leave_one_out_exchange(const basis::RowMajorMatrixXf& rows,
                              const Eigen::MatrixXd& left_vectors,
                              const Eigen::MatrixXd& importance, const Candidates& candidates,
                              const std::vector<std::uint32_t>& start,
                              const LeaveOneOutOptions& options, const ProgressCallback& progress,
                              const std::stop_token& stop) {
  options.validate();
  if (static_cast<std::size_t>(rows.rows()) != basis_cell_count()) {
    throw std::invalid_argument("design: leave one out: " + std::to_string(rows.rows()) +
                                " rows, expected one per basis cell");
  }
  Search search(rows, left_vectors, importance, candidates, options);
  std::set<std::uint32_t> distinct;
  for (const std::uint32_t cell : start) {
    if (cell >= search.gate().size() || !search.gate().accepted(cell) ||
        !distinct.insert(cell).second) {
      throw std::invalid_argument("design: leave one out: start cell " + std::to_string(cell) +
                                  " is not allowed or there twice");
    }
  }
  if (start.empty()) throw std::invalid_argument("design: leave one out: no start");

  Design design;
  design.cells = start;
  design.value = search.value_of(start);
  const std::size_t n = start.size();
  const double total = static_cast<double>(n) * options.sweeps;
  std::size_t unchanged = 0;
  for (std::size_t step = 0; step < n * static_cast<std::size_t>(options.sweeps); ++step) {
    if (unchanged == n) break;
    if (stop.stop_requested()) {
      design.finished = false;
      return design;
    }
    const std::size_t at = step % n;
    ++unchanged;
    std::vector<std::uint32_t> swapped = design.cells;
    swapped[at] = search.best_for(design.cells, at, static_cast<int>(step / n));
    if (swapped[at] != design.cells[at]) {
      const double value = search.value_of(swapped);
      if (value < design.value - kLeastGain) {
        design.cells = std::move(swapped);
        design.value = value;
        ++design.exchanges;
        unchanged = 1;
      }
    }
    if (progress) progress({static_cast<double>(step + 1) / total, design.value});
  }
  design.starts = 1;
  if (progress) progress({1.0, design.value});
  return design;
}

}  // namespace gonio::design
