#pragma once

#include <Eigen/Core>

namespace gonio::calibration::geometry {

/// Covariance of f(errors) at no error, to first order. `steps` for central differences; errors
/// without variance are skipped. `function` takes a vector of errors and returns a vector.
template <typename Function>
Eigen::MatrixXd propagated(const Function& function, const Eigen::MatrixXd& covariance,
                           const Eigen::VectorXd& steps) {
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(steps.size());
  const Eigen::VectorXd middle = function(errors);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(middle.size(), steps.size());
  for (Eigen::Index k = 0; k < steps.size(); ++k) {
    if (covariance(k, k) == 0.0) continue;
    errors[k] = steps[k];
    const Eigen::VectorXd above = function(errors);
    errors[k] = -steps[k];
    jacobian.col(k) = (above - function(errors)) / (2.0 * steps[k]);
    errors[k] = 0.0;
  }
  return jacobian * covariance * jacobian.transpose();
}

}  // namespace gonio::calibration::geometry
