#include "gonio/design/exchange.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <string>

#include "candidate_field.h"
#include "candidate_gate.h"
#include "gonio/random/stream.h"

namespace gonio::design {
namespace {

// A swap must lower the criterion by more than single precision can imagine.
constexpr double kLeastImprovement = 1e-6;
// Updates of the candidates' figures before rounding makes them worth working out afresh.
constexpr int kExchangesPerReset = 8;
// How the time splits between the starts and the polishing, for the progress shown.
constexpr double kStartShare = 0.4;
constexpr double kUsualSweeps = 5.0;

struct Trial {
  std::vector<std::size_t> members;  ///< indices into the pool
  double value = 0.0;
  bool finished = true;
  int exchanges = 0;
};

/// Exchanges over one pool of candidate rows: the selection, or all.
class Pool {
 public:
  /// `cells`  The basis cell of each row; empty when row i is cell i.
  Pool(const basis::RowMajorMatrixXf& rows, std::vector<std::uint32_t> cells,
       const Eigen::MatrixXd& importance, const ExchangeOptions& options, CandidateGate& gate)
      : rows_(rows),
        cells_(std::move(cells)),
        importance_(importance),
        options_(options),
        gate_(gate),
        field_(rows, importance, options.criterion, options.eta),
        allowed_(field_.size()) {
    for (std::size_t i = 0; i < allowed_.size(); ++i) allowed_[i] = gate_.allowed(cell_of(i));
  }

  std::uint32_t cell_of(std::size_t i) const {
    return cells_.empty() ? static_cast<std::uint32_t>(i) : cells_[i];
  }
  std::size_t size() const { return field_.size(); }

  bool usable(std::size_t i) { return allowed_[i] != 0 && accepted(i); }

  /// Fewer members than asked for when the pool has no more usable candidates.
  Trial greedy() {
    Trial trial;
    std::vector<Change> added;
    field_.reset(Eigen::MatrixXd::Identity(rows_.cols(), rows_.cols()));
    while (trial.members.size() < static_cast<std::size_t>(options_.sample_count)) {
      field_.scan(added, nullptr, allowed_);
      const std::size_t next = pick(trial.members, size());
      if (next == size()) return trial;
      added = {adding(options_.criterion, row(next),
                      open_share(rows_of(trial.members), options_.eta), importance_, options_.eta)};
      trial.members.push_back(next);
    }
    trial.value = value_of(trial.members);
    return trial;
  }

  /// Drops one after another and takes the best in its place until a whole round changes nothing.
  /// `tell(trials, value)` after each trial.
  template <typename Tell>
  void exchange(Trial& trial, const std::stop_token& stop, Tell&& tell) {
    const std::size_t n = trial.members.size();
    Eigen::MatrixXd open = open_share(rows_of(trial.members), options_.eta);
    field_.reset(open);
    std::vector<Change> pending;
    std::size_t tried = 0;
    int since_reset = 0;
    for (std::size_t at = 0, unchanged = 0; unchanged < n; at = (at + 1) % n) {
      if (stop.stop_requested()) {
        trial.finished = false;
        return;
      }
      const std::size_t old = trial.members[at];
      const Change drop = dropping(options_.criterion, row(old), open, importance_, options_.eta);
      field_.scan(pending, &drop, allowed_);
      pending.clear();
      const std::size_t next = pick(trial.members, at);
      bool better = false;
      if (next != size() && next != old) {
        trial.members[at] = next;
        const double value = value_of(trial.members);
        better = trial.value - value > kLeastImprovement * std::abs(trial.value);
        if (better) {
          std::vector<std::size_t> others = trial.members;
          others.erase(others.begin() + static_cast<std::ptrdiff_t>(at));
          pending = {
              drop, adding(options_.criterion, row(next), open_share(rows_of(others), options_.eta),
                           importance_, options_.eta)};
          open = open_share(rows_of(trial.members), options_.eta);
          trial.value = value;
          ++trial.exchanges;
          if (++since_reset == kExchangesPerReset) {
            field_.reset(open);
            pending.clear();
            since_reset = 0;
          }
        } else {
          trial.members[at] = old;
        }
      }
      unchanged = better ? 1 : unchanged + 1;
      tell(++tried, trial.value);
    }
  }

  double value_of(const std::vector<std::size_t>& members) const {
    return criterion_value(options_.criterion, rows_of(members), importance_, options_.eta);
  }

 private:
  Eigen::VectorXd row(std::size_t i) const {
    return rows_.row(static_cast<Eigen::Index>(i)).transpose().cast<double>();
  }
  Eigen::MatrixXd rows_of(const std::vector<std::size_t>& members) const {
    Eigen::MatrixXd result(static_cast<Eigen::Index>(members.size()), rows_.cols());
    for (std::size_t i = 0; i < members.size(); ++i) {
      result.row(static_cast<Eigen::Index>(i)) = row(members[i]).transpose();
    }
    return result;
  }

  bool accepted(std::size_t i) {
    if (gate_.accepted(cell_of(i))) return true;
    allowed_[i] = 0;
    return false;
  }

  /// The best of the last scan that may be taken for members[free] (size(): for none of them).
  std::size_t pick(const std::vector<std::size_t>& members, std::size_t free) {
    for (;;) {
      const std::size_t next = field_.best();
      if (next == size()) return next;
      const auto found = std::find(members.begin(), members.end(), next);
      const bool taken =
          found != members.end() && static_cast<std::size_t>(found - members.begin()) != free;
      if (!taken && accepted(next)) return next;
      field_.dismiss(next);
    }
  }

  const basis::RowMajorMatrixXf& rows_;
  std::vector<std::uint32_t> cells_;
  const Eigen::MatrixXd& importance_;
  const ExchangeOptions& options_;
  CandidateGate& gate_;
  CandidateField field_;
  std::vector<std::uint8_t> allowed_;
};

/// About `wanted` of the allowed cells at even distances. The distance is a fraction, so that it
/// does not fall into step with the 180 cells of a phi_d row; all when there are fewer.
std::vector<std::uint32_t> even_selection(const CandidateGate& gate, std::size_t wanted) {
  std::vector<std::uint32_t> allowed;
  for (std::size_t i = 0; i < gate.size(); ++i) {
    const auto cell = static_cast<std::uint32_t>(i);
    if (gate.allowed(cell)) allowed.push_back(cell);
  }
  if (allowed.size() <= wanted) return allowed;
  std::vector<std::uint32_t> selection(wanted);
  for (std::size_t i = 0; i < wanted; ++i) {
    selection[i] = allowed[(2 * i + 1) * allowed.size() / (2 * wanted)];
  }
  return selection;
}

Trial random_start(Pool& pool, std::size_t count, std::uint64_t seed, std::uint64_t start) {
  random::Stream generator(random::make_key(seed, "design.start", start));
  Trial trial;
  // The greedy start has found `count` usable candidates, so this ends.
  while (trial.members.size() < count) {
    const std::size_t next = generator.below(pool.size());
    if (std::find(trial.members.begin(), trial.members.end(), next) == trial.members.end() &&
        pool.usable(next)) {
      trial.members.push_back(next);
    }
  }
  trial.value = pool.value_of(trial.members);
  return trial;
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
                const ProgressCallback& progress, std::stop_token stop) {
  options.validate();
  if (importance.rows() != rows.cols() || importance.cols() != rows.cols()) {
    throw std::invalid_argument("design: the importance matrix is " +
                                std::to_string(importance.rows()) + " x " +
                                std::to_string(importance.cols()) + ", the rows have " +
                                std::to_string(rows.cols()) + " components");
  }
  CandidateGate gate(candidates, static_cast<std::size_t>(rows.rows()));

  Design design;
  double best = std::numeric_limits<double>::infinity();
  const auto tell = [&](double fraction, double value) {
    best = std::min(best, value);
    if (progress) progress({fraction, best});
  };
  const double usual_trials = kUsualSweeps * options.sample_count;
  const auto share_of = [&](std::size_t trials) {
    return std::min(1.0, static_cast<double>(trials) / usual_trials);
  };

  // A selection with room to choose from, however few samples are wanted; a larger one when the
  // gate refuses too much of it.
  const auto count = static_cast<std::size_t>(options.sample_count);
  std::vector<Trial> starts;
  for (std::size_t wanted = std::max(options.start_candidates, 16 * count); starts.empty();
       wanted *= 8) {
    const std::vector<std::uint32_t> selection = even_selection(gate, wanted);
    basis::RowMajorMatrixXf selected(static_cast<Eigen::Index>(selection.size()), rows.cols());
    for (std::size_t i = 0; i < selection.size(); ++i) {
      selected.row(static_cast<Eigen::Index>(i)) = rows.row(selection[i]);
    }
    Pool pool(selected, selection, importance, options, gate);
    for (int start = 0; start < options.starts; ++start) {
      if (start > 0 && stop.stop_requested()) break;
      Trial trial =
          start == 0 ? pool.greedy()
                     : random_start(pool, count, options.seed, static_cast<std::uint64_t>(start));
      if (trial.members.size() < count) {
        if (wanted >= gate.size()) {
          throw std::invalid_argument("design: only " + std::to_string(trial.members.size()) +
                                      " usable candidates for " + std::to_string(count) +
                                      " samples");
        }
        break;
      }
      pool.exchange(trial, stop, [&](std::size_t trials, double value) {
        tell(kStartShare * (start + share_of(trials)) / options.starts, value);
      });
      for (std::size_t& member : trial.members) member = pool.cell_of(member);
      starts.push_back(std::move(trial));
    }
  }
  std::stable_sort(starts.begin(), starts.end(),
                   [](const Trial& a, const Trial& b) { return a.value < b.value; });

  std::optional<Pool> pool;
  for (int i = 0; i < std::min<int>(options.polished, static_cast<int>(starts.size())); ++i) {
    Trial& trial = starts[static_cast<std::size_t>(i)];
    if (stop.stop_requested()) {
      trial.finished = false;
      break;
    }
    if (!pool) pool.emplace(rows, std::vector<std::uint32_t>(), importance, options, gate);
    pool->exchange(trial, stop, [&](std::size_t trials, double value) {
      tell(kStartShare + (1.0 - kStartShare) * (i + share_of(trials)) / options.polished, value);
    });
  }

  for (const Trial& trial : starts) {
    design.exchanges += trial.exchanges;
    design.finished = design.finished && trial.finished;
    design.starts += trial.finished ? 1 : 0;
  }
  design.finished = design.finished && !stop.stop_requested();
  const Trial& winner =
      *std::min_element(starts.begin(), starts.end(),
                        [](const Trial& a, const Trial& b) { return a.value < b.value; });
  for (const std::size_t member : winner.members) {
    design.cells.push_back(static_cast<std::uint32_t>(member));
  }
  design.value = winner.value;
  return design;
}

}  // namespace gonio::design
