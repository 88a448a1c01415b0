#include "gonio/design/leave_one_out.h"

#include <Eigen/LU>
#include <cmath>
#include <stdexcept>
#include <string>

#include "gonio/design/criteria.h"

namespace gonio::design {

LeaveOneOut leave_one_out(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& left_vectors,
                          const Eigen::MatrixXd& importance, double eta,
                          const Eigen::VectorXd& noise) {
  const Eigen::Index k = left_vectors.cols();
  const Eigen::Index m = left_vectors.rows();
  if (rows.cols() != k || importance.rows() != k || importance.cols() != k || m % 3 != 0 ||
      m == 0 || (noise.size() != 0 && noise.size() != rows.rows())) {
    throw std::invalid_argument(
        "leave one out: rows with " + std::to_string(rows.cols()) + " components, importance of " +
        std::to_string(importance.rows()) + ", left vectors of " + std::to_string(m) + " x " +
        std::to_string(k) + ", " + std::to_string(noise.size()) + " noises");
  }
  // Rows scaled to a common noise of eta.
  Eigen::MatrixXd scaled = rows;
  Eigen::VectorXd noise_share = Eigen::VectorXd::Zero(rows.rows());
  if (noise.size() != 0) {
    noise_share = noise.array() / (noise.array() + eta);
    scaled.array().colwise() *= (eta / (noise.array() + eta)).sqrt();
  }
  const Eigen::MatrixXd open = open_share(scaled, eta);
  LeaveOneOut found;
  found.residuals.resize(m, k);
  found.errors.resize(m / 3);
  // Sample j moves the coefficients by (M a_j / eta_j) per unit of its noise.
  const Eigen::MatrixXd moves = scaled * open;
  found.noise =
      ((moves * importance).cwiseProduct(moves).rowwise().sum().array() * noise_share.array())
          .sum() /
      (eta * static_cast<double>(m));
  for (Eigen::Index g = 0; g < m / 3; ++g) {
    const auto u = left_vectors.middleRows<3>(3 * g);
    const Eigen::MatrixXd unseen = u * open;
    const Eigen::Matrix3d leverage = u * u.transpose() - unseen * u.transpose();
    const Eigen::MatrixXd error = (Eigen::Matrix3d::Identity() - leverage).inverse() * unseen;
    found.errors[g] = (error * importance).cwiseProduct(error).sum() / 3.0 + found.noise;
    found.residuals.middleRows<3>(3 * g) = error;
  }
  return found;
}

double leave_one_out_value(const LeaveOneOut& found, const Eigen::MatrixXd& importance,
                           double floor_share) {
  const double floor =
      floor_share * importance.trace() / static_cast<double>(found.residuals.rows());
  return (found.errors.array() + floor).log10().mean();
}

}  // namespace gonio::design
