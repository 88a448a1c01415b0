#include "kernel_solve.h"

#include <Eigen/Dense>

#include "gonio/errors/errors.h"

namespace gonio::basis::detail {
namespace {

/// Rational quadratic of squared distances, clear of rounding below 0.
Eigen::ArrayXXd rational_quadratic(const Eigen::ArrayXXd& square, const KernelShape& shape) {
  return shape.amplitude / (1.0 + square.max(0.0) / (shape.length * shape.length));
}

}  // namespace

KernelSolve::KernelSolve(const Eigen::MatrixXd& left_vectors, const NormalEquations& equations,
                         const KernelShape& shape)
    : left_vectors_(left_vectors), shape_(shape), m_(static_cast<double>(left_vectors.rows())) {
  const Eigen::MatrixXd& u = left_vectors_;
  Eigen::MatrixXd system = u * (equations.information * u.transpose()) / m_;
  const Eigen::MatrixXd inner = u * (equations.likeness * u.transpose());
  likeness_square_ = inner.diagonal();
  if (shape_.amplitude > 0.0) {
    Eigen::ArrayXXd square = -2.0 * inner.array();
    square.colwise() += likeness_square_.array();
    square.rowwise() += likeness_square_.array().transpose();
    system.array() += rational_quadratic(square, shape_);
  }
  system.diagonal().array() += 1.0;
  factor_.compute(system);
  if (factor_.info() != Eigen::Success) {
    throw NumericalError("reconstruct: the kernel system is not positive definite");
  }
}

Eigen::VectorXd KernelSolve::coefficients(const NormalEquations& equations) const {
  const Eigen::MatrixXd& u = left_vectors_;
  Eigen::VectorXd likeness = u * equations.right / m_;
  if (shape_.amplitude > 0.0) {
    const Eigen::ArrayXXd square =
        (likeness_square_ - 2.0 * (u * equations.likeness_right)).array() +
        equations.likeness_square;
    likeness.array() += rational_quadratic(square, shape_).col(0);
  }
  return u.transpose() * factor_.solve(likeness);
}

Eigen::MatrixXd KernelSolve::leave_one_out() const {
  const Eigen::Index m = left_vectors_.rows();
  const Eigen::MatrixXd inverse = factor_.solve(Eigen::MatrixXd::Identity(m, m));
  Eigen::MatrixXd residual = inverse * left_vectors_;
  for (Eigen::Index row = 0; row < m; row += 3) {
    residual.middleRows(row, 3) =
        inverse.block(row, row, 3, 3).llt().solve(residual.middleRows(row, 3)).eval();
  }
  return residual;
}

}  // namespace gonio::basis::detail
