#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "gonio/basis/basis.h"

namespace gonio::design {

/// J of leave_one_out_value() for all designs that differ in one sample, by a rank-one update of
/// what the others leave open.
///
/// With M, E = U M, S = E K E^T of the samples that stay and b = M a, d = eta + a.b for a
/// candidate: v = E a and q = E K M a per training row give each material's new 3 x 3 blocks
///
///     H + v v^T / d,    S - (v q^T + q v^T) / d + v v^T (b.K b) / d^2
///
/// of leverage and error: (2 m + 2 k + 2 n) k multiply-adds per candidate in one product, and 3 x 3
/// algebra. Single precision; what is chosen is judged again in double.
///
/// Threads  values() from many.
class LeaveOneOutField {
 public:
  /// `kept`   n - 1 rows, scaled to a common noise of `eta`; `noise_share` of each.
  LeaveOneOutField(const Eigen::MatrixXd& kept, const Eigen::VectorXd& noise_share,
                   const Eigen::MatrixXd& left_vectors, const Eigen::MatrixXd& importance,
                   double eta, double floor);

  /// J with each of `count` candidates. `candidates` count x k, scaled like the kept rows.
  void values(const float* candidates, const float* noise_share, std::size_t count,
              double* out) const;

 private:
  Eigen::Index k_;
  Eigen::Index materials_;
  Eigen::Index kept_;
  double eta_;
  double floor_;
  double noise_unit_;                 ///< 1 / (eta m)
  double noise_;                      ///< of the kept samples alone
  Eigen::VectorXf kept_noise_share_;  ///< n - 1
  basis::RowMajorMatrixXf products_;  ///< E, E K M, A M, A M K M, M, M K M below each other
  std::vector<float> blocks_;         ///< I - H and S, 6 + 6 per material
};

}  // namespace gonio::design
