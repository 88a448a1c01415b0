#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "block_best.h"
#include "pose_lanes.h"

namespace gonio::design {

/// A change M' = M + sign U U^T by the rows A of a pose that comes (sign -1) or goes (+1).
struct PoseChange {
  double sign;
  Eigen::MatrixXd vectors;  ///< k x 2r: U, then M K U + (sign / 2) U (U^T K U)
};
PoseChange adding_pose(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& open,
                       const Eigen::MatrixXd& importance);
PoseChange dropping_pose(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& open,
                         const Eigen::MatrixXd& importance);

/// What every candidate pose would bring, kept up to date while poses come and go.
///
/// A pose with rows A lowers tr(K M) by tr((1 + V)^-1 W), V = A M A^T, W = A M K M A^T: q x q. A
/// change of M by a pose's worth updates V and W from the products of A with a few fixed vectors,
/// one pass over the rows in single precision; decisions are confirmed in double by whoever asks.
///
/// Memory   Per pose q (k + q + 1) floats, q padded to 1, 4 or 6.
/// Threads  One at a time, but for set_rows() of different poses; the work inside is shared out
///          and the result does not depend on how many there are.
class PoseField {
 public:
  /// `rank`  The most rows a pose may have, at most lanes::kMaxRank.
  PoseField(std::size_t poses, std::size_t rank, Eigen::MatrixXd importance);

  std::size_t size() const { return poses_; }

  /// At most `rank` rows of k.
  void set_rows(std::size_t pose, const Eigen::MatrixXd& rows);
  Eigen::MatrixXd rows(std::size_t pose) const;

  /// Starts from this M (k x k, positive definite).
  void reset(const Eigen::MatrixXd& open);

  /// Gains after the changes, which are kept, and after `trial` (may be null), which is not; of
  /// poses that are not allowed none. Not allowed once is not allowed for ever.
  void scan(const std::vector<PoseChange>& changes, const PoseChange* trial,
            const std::vector<std::uint8_t>& allowed);

  /// The pose with the largest gain of the last scan, the lowest number among equals; size() when
  /// all are dismissed or not allowed.
  std::size_t best() const { return gains_.best(size()); }
  double gain(std::size_t pose) const { return static_cast<double>(gains_[pose]); }
  void dismiss(std::size_t pose) { gains_.dismiss(pose); }

 private:
  std::size_t first_entry(std::size_t pose) const;

  std::size_t poses_;
  std::size_t rank_;  ///< padded
  std::size_t k_;
  Eigen::MatrixXd importance_;
  std::vector<float> rows_;  ///< group, component, row, lane
  std::vector<float> v_;     ///< group, entry of the triangle, lane
  std::vector<float> w_;
  BlockBest gains_;  ///< padded to whole groups
};

}  // namespace gonio::design
