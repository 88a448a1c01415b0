#include "pose_field.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>

#include "gonio/parallel/parallel.h"

namespace gonio::design {
namespace {

using lanes::kLanes;
using lanes::triangle;

constexpr std::size_t kBlockGroups = 32;  // 256 poses: 490 kB of rows at q = 6, k = 80

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

/// As lanes::multiply() wants them, with zero columns up to a whole number of tiles.
class TiledVectors {
 public:
  TiledVectors(std::size_t rank, std::size_t k) : tile_(lanes::column_tile(rank)), k_(k) {}

  void add(const Eigen::MatrixXd& vectors) {
    for (Eigen::Index c = 0; c < vectors.cols(); ++c, ++columns_) {
      const std::size_t start = columns_ / tile_ * tile_ * k_ + columns_ % tile_;
      values_.resize((columns_ / tile_ + 1) * tile_ * k_);
      for (std::size_t j = 0; j < k_; ++j) {
        values_[start + j * tile_] = static_cast<float>(vectors(static_cast<Eigen::Index>(j), c));
      }
    }
  }

  /// Whole tiles.
  std::size_t columns() const { return values_.size() / k_; }
  const float* data() const { return values_.data(); }

 private:
  std::size_t tile_;
  std::size_t k_;
  std::size_t columns_ = 0;
  std::vector<float> values_;
};

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
      gains_(groups_of(poses) * kLanes, kBlockGroups * kLanes) {}

/// Of row 0, component 0; a row is kLanes floats further, a component rank_ rows.
std::size_t PoseField::first_entry(std::size_t pose) const {
  return pose / kLanes * k_ * rank_ * kLanes + pose % kLanes;
}

void PoseField::set_rows(std::size_t pose, const Eigen::MatrixXd& rows) {
  float* const first = rows_.data() + first_entry(pose);
  for (std::size_t j = 0; j < k_; ++j) {
    for (std::size_t i = 0; i < static_cast<std::size_t>(rows.rows()); ++i) {
      first[(j * rank_ + i) * kLanes] =
          static_cast<float>(rows(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
    }
  }
}

Eigen::MatrixXd PoseField::rows(std::size_t pose) const {
  const float* const first = rows_.data() + first_entry(pose);
  Eigen::MatrixXd rows(static_cast<Eigen::Index>(rank_), static_cast<Eigen::Index>(k_));
  for (std::size_t j = 0; j < k_; ++j) {
    for (std::size_t i = 0; i < rank_; ++i) {
      rows(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          static_cast<double>(first[(j * rank_ + i) * kLanes]);
    }
  }
  return rows;
}

void PoseField::reset(const Eigen::MatrixXd& open) {
  // As sums of squares V and W keep their digits where the samples have left little open.
  TiledVectors open_root(rank_, k_);
  open_root.add(root_of(open));
  TiledVectors importance_root(rank_, k_);
  importance_root.add(open * root_of(importance_));
  const std::size_t entries = triangle(rank_) * kLanes;
  parallel::for_each_block(
      0, groups_of(poses_), kBlockGroups, [&](std::size_t from, std::size_t to) {
        std::vector<float> products(rank_ * kLanes * open_root.columns());
        for (std::size_t group = from; group < to; ++group) {
          const float* const rows = rows_.data() + first_entry(group * kLanes);
          const auto squares = [&](const TiledVectors& roots, float* out) {
            lanes::multiply(rank_, rows, k_, roots.data(), roots.columns(), products.data());
            lanes::gram(rank_, products.data(), roots.columns(), out);
          };
          squares(open_root, v_.data() + group * entries);
          squares(importance_root, w_.data() + group * entries);
        }
      });
}

void PoseField::scan(const std::vector<PoseChange>& changes, const PoseChange* trial,
                     const std::vector<std::uint8_t>& allowed) {
  TiledVectors vectors(rank_, k_);
  for (const PoseChange& change : changes) vectors.add(change.vectors);
  if (trial != nullptr) vectors.add(trial->vectors);
  const std::size_t entries = triangle(rank_) * kLanes;

  parallel::for_each_block(
      0, groups_of(poses_), kBlockGroups, [&](std::size_t from, std::size_t to) {
        std::vector<float> products(rank_ * kLanes * vectors.columns());
        std::vector<float> tried_v(entries);
        std::vector<float> tried_w(entries);
        for (std::size_t group = from; group < to; ++group) {
          lanes::multiply(rank_, rows_.data() + first_entry(group * kLanes), k_, vectors.data(),
                          vectors.columns(), products.data());
          const float* at = products.data();
          float* v = v_.data() + group * entries;
          float* w = w_.data() + group * entries;
          const auto apply = [&](const PoseChange& change) {
            const auto r = static_cast<std::size_t>(change.vectors.cols() / 2);
            const std::size_t half = r * rank_ * kLanes;
            lanes::update(rank_, at, at + half, r, static_cast<float>(change.sign), v, w);
            at += 2 * half;
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
              gains[lane] = BlockBest::kNone;
            }
          }
        }
        gains_.settle(from * kLanes);
      });
}

}  // namespace gonio::design
