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

KernelSolve::KernelSolve(const Basis& basis, const RowPrior& prior,
                         const NormalEquations& equations, const KernelShape& shape)
    : left_vectors_(basis.left_vectors), prior_(prior), shape_(shape) {
  const Eigen::MatrixXd& u = left_vectors_;
  const Eigen::MatrixXd v = u.rowwise() - prior.mean.transpose();
  Eigen::MatrixXd system = v * (equations.information * v.transpose()) / prior.mass;
  const Eigen::MatrixXd inner = u * (equations.likeness * u.transpose());
  likeness_square_ = inner.diagonal();
  if (shape_.amplitude > 0.0) {
    Eigen::ArrayXXd square = -2.0 * inner.array();
    square.colwise() += likeness_square_.array();
    square.rowwise() += likeness_square_.array().transpose();
    system.array() += rational_quadratic(square, shape_);
  }
  system.diagonal().array() += prior.weight.array().inverse();
  factor_.compute(system);
  if (factor_.info() != Eigen::Success) {
    throw NumericalError("reconstruct: the kernel system is not positive definite");
  }
}

Eigen::VectorXd KernelSolve::coefficients(const NormalEquations& equations) const {
  const Eigen::MatrixXd& u = left_vectors_;
  const Eigen::VectorXd right = equations.right - equations.information * prior_.mean;
  Eigen::VectorXd likeness = u * right;
  likeness.array() -= prior_.mean.dot(right);
  likeness /= prior_.mass;
  if (shape_.amplitude > 0.0) {
    const Eigen::ArrayXXd square =
        (likeness_square_ - 2.0 * (u * equations.likeness_right)).array() +
        equations.likeness_square;
    likeness.array() += rational_quadratic(square, shape_).col(0);
  }
  const Eigen::VectorXd alpha = factor_.solve(likeness);
  return u.transpose() * alpha + (1.0 - alpha.sum()) * prior_.mean;
}

Eigen::MatrixXd KernelSolve::leave_out(const std::vector<std::vector<Eigen::Index>>& groups) const {
  const Eigen::Index m = left_vectors_.rows();
  const Eigen::MatrixXd inverse = factor_.solve(Eigen::MatrixXd::Identity(m, m));
  Eigen::MatrixXd residual = inverse * (left_vectors_.rowwise() - prior_.mean.transpose());
  for (const std::vector<Eigen::Index>& rows : groups) {
    const Eigen::MatrixXd own = residual(rows, Eigen::all);
    residual(rows, Eigen::all) = Eigen::MatrixXd(inverse(rows, rows)).llt().solve(own).eval();
  }
  return residual;
}

}  // namespace gonio::basis::detail
