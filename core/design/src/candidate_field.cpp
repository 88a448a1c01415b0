#include "candidate_field.h"

#include <cblas.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "gonio/parallel/parallel.h"
#include "row_products.h"

namespace gonio::design {
namespace {

constexpr std::size_t kFieldBlock = 2048;  // 650 kB of rows at k = 80: stays in a core's cache

Change change_of(Criterion criterion, double beta, const Eigen::VectorXd& h,
                 const Eigen::MatrixXd& open, const Eigen::MatrixXd& importance) {
  const Eigen::VectorXd importance_h = importance * h;
  const Eigen::VectorXd open_importance_h = open * importance_h;
  Change change{beta, {}, h.squaredNorm(), h.dot(importance_h), h.dot(open_importance_h)};
  switch (criterion) {
    case Criterion::bayes_d:
      change.vectors = h;
      break;
    case Criterion::bayes_a:
      change.vectors.resize(h.size(), 2);
      change.vectors << h, open_importance_h;
      break;
    case Criterion::xu_squared: {
      const Eigen::VectorXd open_h = open * h;
      change.vectors.resize(h.size(), 5);
      change.vectors << h, open_importance_h, open_h, open * open_importance_h,
          open * (importance * open_h);
      break;
    }
  }
  return change;
}

/// out (count x columns, row-major) = rows * vectors.
void multiply(const float* rows, std::size_t count, std::size_t k,
              const basis::RowMajorMatrixXf& vectors, float* out) {
  const auto columns = static_cast<int>(vectors.cols());
  cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(count), columns,
              static_cast<int>(k), 1.0F, rows, static_cast<int>(k), vectors.data(), columns, 0.0F,
              out, columns);
}

}  // namespace

Change adding(Criterion criterion, const Eigen::VectorXd& row, const Eigen::MatrixXd& open,
              const Eigen::MatrixXd& importance, double eta) {
  const Eigen::VectorXd h = open * row;
  return change_of(criterion, -1.0 / (eta + row.dot(h)), h, open, importance);
}

Change dropping(Criterion criterion, const Eigen::VectorXd& row, const Eigen::MatrixXd& open,
                const Eigen::MatrixXd& importance, double eta) {
  const Eigen::VectorXd h = open * row;
  return change_of(criterion, 1.0 / (eta - row.dot(h)), h, open, importance);
}

CandidateField::CandidateField(const basis::RowMajorMatrixXf& rows,
                               const Eigen::MatrixXd& importance, Criterion criterion, double eta,
                               std::vector<float> noise, const std::vector<float>& penalty)
    : rows_(rows),
      importance_(importance.cast<float>()),
      criterion_(criterion),
      eta_(eta),
      noise_(std::move(noise)),
      price_(penalty.size()),
      second_order_(criterion == Criterion::xu_squared),
      figures_((second_order_ ? 4 : 2) * size()),
      gains_(size(), kFieldBlock) {
  std::transform(penalty.begin(), penalty.end(), price_.begin(),
                 [](float share) { return std::exp(share); });
}

void CandidateField::reset(const Eigen::MatrixXd& open) {
  const basis::RowMajorMatrixXf open_float = open.cast<float>();
  const auto k = static_cast<std::size_t>(rows_.cols());
  parallel::for_each_block(0, size(), kFieldBlock, [&](std::size_t from, std::size_t to) {
    const auto count = static_cast<Eigen::Index>(to - from);
    const auto times = [&](const float* left, const basis::RowMajorMatrixXf& right) {
      basis::RowMajorMatrixXf product(count, right.cols());
      multiply(left, to - from, k, right, product.data());
      return product;
    };
    const basis::RowMajorMatrixXf b = times(rows_.data() + from * k, open_float);
    const basis::RowMajorMatrixXf importance_b = times(b.data(), importance_);
    basis::RowMajorMatrixXf open_b;
    if (second_order_) open_b = times(b.data(), open_float);
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Index row = static_cast<Eigen::Index>(from) + i;
      double* kept = figures_.data() + static_cast<std::size_t>(row) * (second_order_ ? 4 : 2);
      kept[0] = rows_.row(row).dot(b.row(i));
      kept[1] = b.row(i).dot(importance_b.row(i));
      if (second_order_) {
        kept[2] = b.row(i).squaredNorm();
        kept[3] = open_b.row(i).dot(importance_b.row(i));
      }
    }
  });
}

template <typename Number>
CandidateField::Figures CandidateField::after(const Figures& at, const Change& change,
                                              const Number* products) const {
  const double q_h = products[0];
  const double tau = change.beta * q_h;
  Figures next = at;
  next.v += tau * q_h;
  if (criterion_ == Criterion::bayes_d) return next;
  const double q_open_importance_h = products[1];
  next.w += tau * (2.0 * q_open_importance_h + tau * change.h_importance_h);
  if (!second_order_) return next;
  const double q_open_h = products[2];
  next.s += tau * (2.0 * q_open_h + tau * change.h_h);
  next.z += tau * (static_cast<double>(products[3]) + static_cast<double>(products[4]) +
                   tau * change.h_open_importance_h) +
            change.beta * (q_open_h + tau * change.h_h) *
                (q_open_importance_h + tau * change.h_importance_h);
  return next;
}

double CandidateField::gain(const Figures& at, std::size_t candidate) const {
  const double eta = noise_.empty() ? eta_ : eta_ + static_cast<double>(noise_[candidate]);
  const double d = eta + at.v;
  switch (criterion_) {
    case Criterion::bayes_d:
      return d / eta;  // its logarithm is gained
    case Criterion::bayes_a:
      return at.w / d;
    case Criterion::xu_squared:
      return (2.0 * at.z - at.s * at.w / d) / d;
  }
  return 0.0;
}

void CandidateField::scan(const std::vector<Change>& changes, const Change* trial,
                          const std::vector<std::uint8_t>& allowed, double value) {
  const auto k = static_cast<std::size_t>(rows_.cols());
  const std::size_t stride = second_order_ ? 4 : 2;
  const std::size_t per_change =
      trial != nullptr
          ? static_cast<std::size_t>(trial->vectors.cols())
          : (changes.empty() ? 0 : static_cast<std::size_t>(changes[0].vectors.cols()));
  Eigen::MatrixXf tried;
  if (trial != nullptr) tried = trial->vectors.cast<float>();

  parallel::for_each_block(0, size(), kFieldBlock, [&](std::size_t from, std::size_t to) {
    std::vector<double> kept_products(per_change);
    std::vector<float> tried_products(per_change);
    for (std::size_t i = from; i < to; ++i) {
      if (allowed[i] == 0) {  // never allowed again: its figures may go stale
        gains_[i] = BlockBest::kNone;
        continue;
      }
      const float* row = rows_.data() + i * k;
      double* kept = figures_.data() + i * stride;
      Figures at{kept[0], kept[1], second_order_ ? kept[2] : 0.0, second_order_ ? kept[3] : 0.0};
      for (const Change& change : changes) {
        row_products(row, k, change.vectors.data(), per_change, kept_products.data());
        at = after(at, change, kept_products.data());
      }
      if (!changes.empty()) {
        kept[0] = at.v;
        kept[1] = at.w;
        if (second_order_) {
          kept[2] = at.s;
          kept[3] = at.z;
        }
      }
      if (trial != nullptr) {
        row_products(row, k, tried.data(), per_change, tried_products.data());
        at = after(at, *trial, tried_products.data());
      }
      double gained = gain(at, i);
      if (!price_.empty()) {
        const auto price = static_cast<double>(price_[i]);
        // What is lowered is the criterion times the prices of all samples; its order is the same.
        gained = criterion_ == Criterion::bayes_d ? gained / price : (gained - value) * price;
      }
      gains_[i] = static_cast<float>(gained);
    }
    gains_.settle(from);
  });
}

}  // namespace gonio::design
