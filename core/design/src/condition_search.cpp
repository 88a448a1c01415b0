#include "gonio/design/condition_search.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "gonio/design/criteria.h"
#include "published_search.h"

namespace gonio::design {
namespace {

/// The rows chosen so far and the condition number one more would give.
class ConditionedSet final : public GrowingSet {
 public:
  ConditionedSet(const basis::RowMajorMatrixXf& rows, Eigen::Index columns)
      : rows_(rows), columns_(columns) {}

  void add(std::uint32_t cell) override {
    gram_ = with(cell);
    cells_.push_back(cell);
  }

  /// Square of the condition number: its order is the same, and the Gram matrix is enough. The
  /// search never meets numbers beyond the 1e8 this can tell apart unless it must add a repeat.
  double value_with(std::uint32_t cell) const override {
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

Design condition_search(const basis::RowMajorMatrixXf& rows, const Candidates& candidates,
                        const ConditionSearchOptions& options, const ProgressCallback& progress,
                        const std::stop_token& stop) {
  options.validate();
  require_lattice_rows(rows);
  CandidateGate gate(candidates, static_cast<std::size_t>(rows.rows()));
  const Eigen::Index columns = std::min<Eigen::Index>(options.sample_count, rows.cols());
  ConditionedSet set(rows, columns);
  Design design = published_search(
      set, gate, options, "design.condition_search",
      [&] { return largest_row(rows, columns, gate); },
      [](double square) { return std::sqrt(square); }, progress, stop);
  design.value = condition_number(set.matrix());
  return design;
}

}  // namespace gonio::design
