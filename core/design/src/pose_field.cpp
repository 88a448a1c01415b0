#include "pose_field.h"

#include <cblas.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

#include "gonio/parallel/parallel.h"

namespace gonio::design {
namespace {

using lanes::kLanes;
using lanes::triangle;

constexpr std::size_t kBlockGroups = 32;  // 256 poses: 740 kB of rows at q = 9, k = 80
constexpr float kNone = -std::numeric_limits<float>::infinity();

std::size_t groups_of(std::size_t poses) { return (poses + kLanes - 1) / kLanes; }

PoseChange change_of(double sign, const Eigen::MatrixXd& rows, const Eigen::MatrixXd& open,
                     const Eigen::MatrixXd& importance) {
  const Eigen::MatrixXd h = open * rows.transpose();
  const Eigen::Index r = rows.rows();
  const Eigen::LLT<Eigen::MatrixXd> root(Eigen::MatrixXd::Identity(r, r) - sign * (rows * h));
  const Eigen::MatrixXd u = root.matrixL().solve(h.transpose()).transpose();
  const Eigen::MatrixXd importance_u = importance * u;
  PoseChange change{sign, Eigen::MatrixXd(h.rows(), 2 * r)};
  change.vectors << u, open * importance_u + 0.5 * sign * (u * (u.transpose() * importance_u));
  return change;
}

/// Symmetric positive semidefinite root.
Eigen::MatrixXd root_of(const Eigen::MatrixXd& matrix) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(matrix);
  return solver.eigenvectors() * solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

/// out (count x columns, column-major) = rows (count x k, row-major) * vectors (k x columns).
void multiply(const float* rows, std::size_t count, std::size_t k, const Eigen::MatrixXf& vectors,
              float* out) {
  cblas_sgemm(CblasColMajor, CblasTrans, CblasNoTrans, static_cast<int>(count),
              static_cast<int>(vectors.cols()), static_cast<int>(k), 1.0F, rows,
              static_cast<int>(k), vectors.data(), static_cast<int>(k), 0.0F, out,
              static_cast<int>(count));
}

}  // namespace

PoseChange adding_pose(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& open,
                       const Eigen::MatrixXd& importance) {
  return change_of(-1.0, rows, open, importance);
}

PoseChange dropping_pose(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& open,
                         const Eigen::MatrixXd& importance) {
  return change_of(1.0, rows, open, importance);
}

PoseField::PoseField(std::size_t poses, std::size_t rank, Eigen::MatrixXd importance)
    : poses_(poses),
      rank_(lanes::padded_rank(rank)),
      k_(static_cast<std::size_t>(importance.rows())),
      importance_(std::move(importance)),
      rows_(groups_of(poses) * kLanes * rank_ * k_),
      v_(groups_of(poses) * kLanes * triangle(rank_)),
      w_(v_.size()),
      gains_(groups_of(poses) * kLanes, kNone),
      block_best_((groups_of(poses) + kBlockGroups - 1) / kBlockGroups) {}

std::size_t PoseField::row_start(std::size_t pose, std::size_t row) const {
  return ((pose / kLanes * rank_ + row) * kLanes + pose % kLanes) * k_;
}

void PoseField::set_rows(std::size_t pose, const Eigen::MatrixXd& rows) {
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    Eigen::Map<Eigen::RowVectorXf>(rows_.data() + row_start(pose, static_cast<std::size_t>(i)),
                                   rows.cols()) = rows.row(i).cast<float>();
  }
}

Eigen::MatrixXd PoseField::rows(std::size_t pose) const {
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(rank_), static_cast<Eigen::Index>(k_));
  for (std::size_t i = 0; i < rank_; ++i) {
    rows.row(static_cast<Eigen::Index>(i)) =
        Eigen::Map<const Eigen::RowVectorXf>(rows_.data() + row_start(pose, i),
                                             static_cast<Eigen::Index>(k_))
            .cast<double>();
  }
  return rows;
}

void PoseField::reset(const Eigen::MatrixXd& open) {
  // As sums of squares V and W keep their digits where the samples have left little open.
  const auto k = static_cast<Eigen::Index>(k_);
  Eigen::MatrixXf roots(k, 2 * k);
  roots << root_of(open).cast<float>(), (open * root_of(importance_)).cast<float>();
  parallel::for_each_block(
      0, groups_of(poses_), kBlockGroups, [&](std::size_t from, std::size_t to) {
        const std::size_t group_rows = rank_ * kLanes;
        const std::size_t count = (to - from) * group_rows;
        std::vector<float> products(count * 2 * k_);
        multiply(rows_.data() + from * group_rows * k_, count, k_, roots, products.data());
        const std::size_t entries = triangle(rank_) * kLanes;
        for (std::size_t group = from; group < to; ++group) {
          const float* const at = products.data() + (group - from) * group_rows;
          lanes::gram(rank_, at, count, k_, v_.data() + group * entries);
          lanes::gram(rank_, at + k_ * count, count, k_, w_.data() + group * entries);
        }
      });
}

void PoseField::scan(const std::vector<PoseChange>& changes, const PoseChange* trial,
                     const std::vector<std::uint8_t>& allowed) {
  const auto k = static_cast<Eigen::Index>(k_);
  Eigen::Index columns = trial != nullptr ? trial->vectors.cols() : 0;
  for (const PoseChange& change : changes) columns += change.vectors.cols();
  Eigen::MatrixXf vectors(k, columns);
  Eigen::Index filled = 0;
  for (const PoseChange& change : changes) {
    vectors.middleCols(filled, change.vectors.cols()) = change.vectors.cast<float>();
    filled += change.vectors.cols();
  }
  if (trial != nullptr) vectors.rightCols(trial->vectors.cols()) = trial->vectors.cast<float>();

  parallel::for_each_block(
      0, groups_of(poses_), kBlockGroups, [&](std::size_t from, std::size_t to) {
        const std::size_t group_rows = rank_ * kLanes;
        const std::size_t count = (to - from) * group_rows;
        const std::size_t entries = triangle(rank_) * kLanes;
        std::vector<float> products(count * static_cast<std::size_t>(columns));
        if (columns > 0) {
          multiply(rows_.data() + from * group_rows * k_, count, k_, vectors, products.data());
        }
        std::vector<float> tried_v(entries);
        std::vector<float> tried_w(entries);
        for (std::size_t group = from; group < to; ++group) {
          const float* at = products.data() + (group - from) * group_rows;
          float* v = v_.data() + group * entries;
          float* w = w_.data() + group * entries;
          const auto apply = [&](const PoseChange& change) {
            const auto r = static_cast<std::size_t>(change.vectors.cols() / 2);
            lanes::update(rank_, at, at + r * count, count, r, static_cast<float>(change.sign), v,
                          w);
            at += 2 * r * count;
          };
          for (const PoseChange& change : changes) apply(change);
          if (trial != nullptr) {
            std::copy_n(v, entries, tried_v.data());
            std::copy_n(w, entries, tried_w.data());
            v = tried_v.data();
            w = tried_w.data();
            apply(*trial);
          }
          float* const gains = gains_.data() + group * kLanes;
          lanes::gain(rank_, v, w, gains);
          for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const std::size_t pose = group * kLanes + lane;
            // Not a number would win or lose every comparison; it is nobody's gain.
            if (pose >= poses_ || allowed[pose] == 0 || !(gains[lane] >= 0.0F)) {
              gains[lane] = kNone;
            }
          }
        }
        find_block_best(from / kBlockGroups);
      });
}

void PoseField::find_block_best(std::size_t block) {
  const std::size_t from = block * kBlockGroups * kLanes;
  const std::size_t to = std::min(gains_.size(), from + kBlockGroups * kLanes);
  const auto first = gains_.begin() + static_cast<std::ptrdiff_t>(from);
  const auto best = std::max_element(first, gains_.begin() + static_cast<std::ptrdiff_t>(to));
  block_best_[block] = from + static_cast<std::size_t>(best - first);
}

std::size_t PoseField::best() const {
  std::size_t found = size();
  float gain = kNone;
  for (const std::size_t candidate : block_best_) {
    if (gains_[candidate] > gain) {
      gain = gains_[candidate];
      found = candidate;
    }
  }
  return found;
}

void PoseField::dismiss(std::size_t pose) {
  gains_[pose] = kNone;
  find_block_best(pose / (kBlockGroups * kLanes));
}

}  // namespace gonio::design
