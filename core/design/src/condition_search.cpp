#include "gonio/design/condition_search.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "candidate_gate.h"
#include "gonio/brdf/merl_lattice.h"
#include "gonio/design/criteria.h"
#include "gonio/random/stream.h"

namespace gonio::design {
namespace {

namespace lattice = brdf::lattice;

constexpr std::array<int, 2> kSteps = {3, 1};

/// The rows chosen so far and the condition number one more would give.
class Chosen {
 public:
  explicit Chosen(const basis::RowMajorMatrixXf& rows, Eigen::Index columns)
      : rows_(rows), columns_(columns) {}

  bool has(std::uint32_t cell) const {
    return std::find(cells_.begin(), cells_.end(), cell) != cells_.end();
  }
  std::size_t size() const { return cells_.size(); }
  const std::vector<std::uint32_t>& cells() const { return cells_; }

  void add(std::uint32_t cell) {
    gram_ = with(cell);
    cells_.push_back(cell);
  }

  /// Square of the condition number: its order is the same, and the Gram matrix is enough. The
  /// search never meets numbers beyond the 1e8 this can tell apart unless it must add a repeat.
  double squared_condition_with(std::uint32_t cell) const {
    const Eigen::VectorXd values =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(with(cell), Eigen::EigenvaluesOnly)
            .eigenvalues();
    // More rows than columns: the spare eigenvalues are 0 by construction.
    const Eigen::Index least = std::max<Eigen::Index>(0, values.size() - columns_);
    return values[least] > 0.0 ? values[values.size() - 1] / values[least]
                               : std::numeric_limits<double>::infinity();
  }

  Eigen::MatrixXd matrix() const {
    Eigen::MatrixXd result(static_cast<Eigen::Index>(cells_.size()), columns_);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      result.row(static_cast<Eigen::Index>(i)) = row(cells_[i]).transpose();
    }
    return result;
  }

 private:
  Eigen::VectorXd row(std::uint32_t cell) const {
    return rows_.row(cell).head(columns_).transpose().cast<double>();
  }

  Eigen::MatrixXd with(std::uint32_t cell) const {
    const Eigen::Index n = gram_.rows();
    const Eigen::VectorXd added = row(cell);
    Eigen::MatrixXd gram(n + 1, n + 1);
    gram.topLeftCorner(n, n) = gram_;
    for (Eigen::Index i = 0; i < n; ++i) {
      gram(i, n) = gram(n, i) = added.dot(row(cells_[static_cast<std::size_t>(i)]));
    }
    gram(n, n) = added.squaredNorm();
    return gram;
  }

  const basis::RowMajorMatrixXf& rows_;
  Eigen::Index columns_;
  std::vector<std::uint32_t> cells_;
  Eigen::MatrixXd gram_;
};

/// The basis cells one step away along each lattice axis; phi_d wraps by reciprocity.
std::vector<std::uint32_t> neighbours(std::uint32_t cell, int step) {
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  const lattice::Index at = lattice::index_from_cell(cells[cell]);
  const auto turned = [](int phi_d) {
    return (phi_d + static_cast<int>(lattice::kPhiD)) % static_cast<int>(lattice::kPhiD);
  };
  const std::array<lattice::Index, 6> moves = {{
      {at.theta_h - step, at.theta_d, at.phi_d},
      {at.theta_h + step, at.theta_d, at.phi_d},
      {at.theta_h, at.theta_d - step, at.phi_d},
      {at.theta_h, at.theta_d + step, at.phi_d},
      {at.theta_h, at.theta_d, turned(at.phi_d - step)},
      {at.theta_h, at.theta_d, turned(at.phi_d + step)},
  }};
  std::vector<std::uint32_t> found;
  for (const lattice::Index& to : moves) {
    if (to.theta_h < 0 || to.theta_h >= static_cast<int>(lattice::kThetaH) || to.theta_d < 0 ||
        to.theta_d >= static_cast<int>(lattice::kThetaD)) {
      continue;
    }
    const auto wanted = static_cast<std::uint32_t>(lattice::cell_from_index(to));
    const auto place = std::lower_bound(cells.begin(), cells.end(), wanted);
    if (place != cells.end() && *place == wanted) {
      found.push_back(static_cast<std::uint32_t>(place - cells.begin()));
    }
  }
  return found;
}

std::uint32_t largest_row(const basis::RowMajorMatrixXf& rows, Eigen::Index columns,
                          CandidateGate& gate) {
  for (;;) {
    float largest = -1.0F;
    std::uint32_t found = 0;
    for (std::size_t i = 0; i < gate.size(); ++i) {
      const auto cell = static_cast<std::uint32_t>(i);
      if (!gate.allowed(cell)) continue;
      const float norm = rows.row(static_cast<Eigen::Index>(i)).head(columns).squaredNorm();
      if (norm > largest) {
        largest = norm;
        found = cell;
      }
    }
    if (largest < 0.0F) {
      throw std::invalid_argument("design: no usable candidate");
    }
    if (gate.accepted(found)) return found;
  }
}

}  // namespace

void ConditionSearchOptions::validate() const {
  if (sample_count < 1) {
    throw std::invalid_argument("design: sample_count is " + std::to_string(sample_count) +
                                ", expected at least 1");
  }
  if (random_cells < 1) {
    throw std::invalid_argument("design: random_cells is " + std::to_string(random_cells) +
                                ", expected at least 1");
  }
}

Design condition_search(const basis::RowMajorMatrixXf& rows, const Candidates& candidates,
                        const ConditionSearchOptions& options, const ProgressCallback& progress,
                        const std::stop_token& stop) {
  options.validate();
  const auto cells = static_cast<std::size_t>(rows.rows());
  if (cells != basis_cell_count() || rows.cols() < 1) {
    throw std::invalid_argument("design: the rows are " + std::to_string(cells) + " x " +
                                std::to_string(rows.cols()) + ", expected " +
                                std::to_string(basis_cell_count()) + " cells and a component");
  }
  CandidateGate gate(candidates, cells);
  std::vector<std::uint32_t> allowed;
  for (std::size_t i = 0; i < cells; ++i) {
    if (gate.allowed(static_cast<std::uint32_t>(i)))
      allowed.push_back(static_cast<std::uint32_t>(i));
  }
  const auto wanted = static_cast<std::size_t>(options.sample_count);
  const auto refuse_too_few = [&](std::size_t found) {
    throw std::invalid_argument("design: only " + std::to_string(found) +
                                " usable candidates for " + std::to_string(wanted) + " samples");
  };
  if (allowed.size() < wanted) refuse_too_few(allowed.size());

  const Eigen::Index columns = std::min<Eigen::Index>(options.sample_count, rows.cols());
  Chosen chosen(rows, columns);
  chosen.add(largest_row(rows, columns, gate));
  random::Stream generator(random::make_key(options.seed, "design.condition_search"));
  Design design;
  const auto usable = [&](std::uint32_t cell) {
    return gate.allowed(cell) && !chosen.has(cell) && gate.accepted(cell);
  };

  while (chosen.size() < wanted) {
    // Once asked to stop, the rest is filled with single random cells: a whole set, only a poor
    // one.
    const bool hurry = stop.stop_requested();
    design.finished = design.finished && !hurry;
    double best = std::numeric_limits<double>::infinity();
    std::uint32_t cell = 0;
    bool found = false;
    int tried = 0;
    // The published search has no forbidden cells; ours draws until it has 500 that may be used,
    // and gives up where next to none are.
    for (std::size_t draw = 0; tried < (hurry ? 1 : options.random_cells); ++draw) {
      if (draw > 20 * allowed.size() + 1000) break;
      const std::uint32_t next = allowed[generator.below(allowed.size())];
      if (!usable(next)) continue;
      ++tried;
      const double condition = chosen.squared_condition_with(next);
      if (!found || condition < best) {
        found = true;
        best = condition;
        cell = next;
      }
    }
    if (!found) refuse_too_few(chosen.size());
    for (const int step : kSteps) {
      for (bool moved = !hurry; moved;) {
        moved = false;
        for (const std::uint32_t next : neighbours(cell, step)) {
          if (!usable(next)) continue;
          const double condition = chosen.squared_condition_with(next);
          if (condition < best) {
            best = condition;
            cell = next;
            moved = true;
          }
        }
      }
    }
    chosen.add(cell);
    if (progress) {
      progress({static_cast<double>(chosen.size()) / static_cast<double>(wanted), std::sqrt(best)});
    }
  }
  design.cells = chosen.cells();
  design.value = condition_number(chosen.matrix());
  design.starts = 1;
  return design;
}

}  // namespace gonio::design
