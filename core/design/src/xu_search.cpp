#include "gonio/design/xu_search.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "gonio/basis/reconstruct.h"
#include "gonio/design/criteria.h"
#include "published_search.h"

namespace gonio::design {
namespace {

/// The metric with one more sample, by a rank-one update of every training row's error: with
/// b = M a and d = eta + a.b the error Sigma M u_i loses Sigma b (u_i.b) / d.
class MeasuredSet final : public GrowingSet {
 public:
  MeasuredSet(const basis::RowMajorMatrixXf& rows, const Eigen::VectorXd& singular_values,
              const Eigen::MatrixXd& left_vectors)
      : rows_(rows),
        left_(left_vectors.leftCols(rows.cols())),
        squares_(singular_values.head(rows.cols()).array().square()),
        left_out_(singular_values.tail(singular_values.size() - rows.cols()).squaredNorm() /
                  static_cast<double>(left_vectors.rows())) {
    update();
  }

  double value_with(std::uint32_t cell) const override {
    const Eigen::VectorXd a = rows_.row(cell).transpose().cast<double>();
    const Eigen::VectorXd b = open_ * a;
    const double d = basis::kPublishedEta + a.dot(b);
    const Eigen::ArrayXd v = (left_ * b).array() / d;
    const Eigen::ArrayXd q = (weighted_ * b).array();
    const double bend = b.cwiseAbs2().dot(squares_);
    return (errors_ - 2.0 * v * q + v.square() * bend + left_out_).max(0.0).sqrt().mean();
  }

  void add(std::uint32_t cell) override {
    samples_.conservativeResize(samples_.rows() + 1, rows_.cols());
    samples_.row(samples_.rows() - 1) = rows_.row(cell).cast<double>();
    update();
  }

  const Eigen::MatrixXd& samples() const { return samples_; }

 private:
  void update() {
    if (samples_.rows() == 0) samples_.resize(0, rows_.cols());
    open_ = open_share(samples_, basis::kPublishedEta);
    const Eigen::MatrixXd unseen = left_ * open_;
    weighted_ = unseen * squares_.asDiagonal();
    errors_ = weighted_.cwiseProduct(unseen).rowwise().sum();
  }

  const basis::RowMajorMatrixXf& rows_;
  Eigen::MatrixXd left_;
  Eigen::VectorXd squares_;
  double left_out_;
  Eigen::MatrixXd samples_;
  Eigen::MatrixXd open_;
  Eigen::MatrixXd weighted_;
  Eigen::ArrayXd errors_;
};

}  // namespace

Design xu_search(const basis::RowMajorMatrixXf& rows, const Eigen::VectorXd& singular_values,
                 const Eigen::MatrixXd& left_vectors, const Candidates& candidates,
                 const ConditionSearchOptions& options, const ProgressCallback& progress,
                 const std::stop_token& stop) {
  options.validate();
  require_lattice_rows(rows);
  if (singular_values.size() < rows.cols() || left_vectors.cols() < rows.cols()) {
    throw std::invalid_argument("design: " + std::to_string(rows.cols()) + " components, " +
                                std::to_string(singular_values.size()) + " singular values, " +
                                std::to_string(left_vectors.cols()) + " left vectors");
  }
  CandidateGate gate(candidates, static_cast<std::size_t>(rows.rows()));
  MeasuredSet set(rows, singular_values, left_vectors);
  Design design = published_search(
      set, gate, options, "design.xu_search", {}, [](double value) { return value; }, progress,
      stop);
  design.value = xu_metric(set.samples(), singular_values, left_vectors, basis::kPublishedEta);
  return design;
}

}  // namespace gonio::design
