#include "normal_equations.h"

#include <Eigen/Cholesky>

namespace gonio::basis::detail {
namespace {

Eigen::MatrixXd weighted_square(const Eigen::MatrixXd& a) {
  Eigen::MatrixXd square = Eigen::MatrixXd::Zero(a.cols(), a.cols());
  square.selfadjointView<Eigen::Lower>().rankUpdate(a.transpose());
  square.triangularView<Eigen::StrictlyUpper>() = square.transpose();
  return square;
}

}  // namespace

double NormalEquations::chi2(const Eigen::VectorXd& coefficients) const {
  return square - 2.0 * right.dot(coefficients) +
         coefficients.dot(information.selfadjointView<Eigen::Lower>() * coefficients);
}

NormalEquations normal_equations(const SampleRows& rows, const MappedSamples& mapped) {
  const Eigen::VectorXd precision_root = mapped.variance.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd a = precision_root.asDiagonal() * rows.a;
  const Eigen::VectorXd y = precision_root.cwiseProduct(mapped.x - rows.mean);
  const Eigen::MatrixXd v = precision_root.asDiagonal() * mapped.common;

  NormalEquations equations;
  equations.information = weighted_square(a);
  equations.right = a.transpose() * y;
  equations.square = y.squaredNorm();
  for (const auto& members : rows.poses) {
    const Eigen::MatrixXd v_pose = v(members, Eigen::all);
    if ((v_pose.array() == 0.0).all()) continue;
    // L^-1 V^T A with L L^T = 1 + V^T V.
    const Eigen::LLT<Eigen::MatrixXd> small(Eigen::MatrixXd::Identity(v.cols(), v.cols()) +
                                            v_pose.transpose() * v_pose);
    const Eigen::MatrixXd projected_a =
        small.matrixL().solve(v_pose.transpose() * a(members, Eigen::all));
    const Eigen::VectorXd projected_y = small.matrixL().solve(v_pose.transpose() * y(members));
    equations.information -= projected_a.transpose() * projected_a;
    equations.right -= projected_a.transpose() * projected_y;
    equations.square -= projected_y.squaredNorm();
  }

  const Eigen::VectorXd total = mapped.variance + mapped.common.rowwise().squaredNorm();
  const double sum = total.cwiseInverse().sum();
  const Eigen::VectorXd share_root = (total * sum).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd likeness_a = share_root.asDiagonal() * rows.a;
  const Eigen::VectorXd likeness_y = share_root.cwiseProduct(mapped.x - rows.mean);
  equations.likeness = weighted_square(likeness_a);
  equations.likeness_right = likeness_a.transpose() * likeness_y;
  equations.likeness_square = likeness_y.squaredNorm();
  return equations;
}

}  // namespace gonio::basis::detail
