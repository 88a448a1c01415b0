#include "gonio/design/pose_information.h"

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "gonio/design/criteria.h"

namespace gonio::design {

void PoseNoise::validate() const {
  const auto require = [](double value, const char* field) {
    if (!(value >= 0.0 && std::isfinite(value))) {
      throw std::invalid_argument("pose noise: " + std::string(field) + " is " +
                                  std::to_string(value) + ", expected 0 or more");
    }
  };
  require(independent, "independent");
  require(common, "common");
  require(model_eta, "model_eta");
  if (independent == 0.0 && model_eta == 0.0) {
    throw std::invalid_argument("pose noise: independent and model_eta are both 0");
  }
}

Eigen::MatrixXd pose_rows(const basis::BasisRows& rows, const brdf::HalfDiff& centre,
                          const PatchGeometry& patch, const PoseNoise& noise) {
  const std::vector<brdf::HalfDiff> directions = patch_directions(centre, patch);
  Eigen::MatrixXd a = rows_at(rows, directions);
  const double m = rows.basis().row_count();
  const double variance = noise.independent * noise.independent + noise.model_eta / m;
  // R = s^2 (1 + r 1 1^T) has the symmetric inverse root (1 - g 1 1^T) / s.
  const double n = static_cast<double>(a.rows());
  const double ratio = noise.common * noise.common / variance;
  const double g = (1.0 - 1.0 / std::sqrt(1.0 + ratio * n)) / n;
  const Eigen::RowVectorXd shared = g * a.colwise().sum();
  a.rowwise() -= shared;
  return a / std::sqrt(variance * m);
}

double expected_error(const basis::BasisRows& rows, const Eigen::MatrixXd& importance,
                      std::span<const brdf::HalfDiff> poses, const PatchGeometry& patch,
                      const PoseNoise& noise) {
  const double m = rows.basis().row_count();
  std::vector<Eigen::MatrixXd> blocks;
  Eigen::Index count = 0;
  for (const brdf::HalfDiff& pose : poses) {
    blocks.push_back(pose_rows(rows, pose, patch, noise));
    count += blocks.back().rows();
  }
  Eigen::MatrixXd all(count, importance.rows());
  Eigen::Index at = 0;
  for (const Eigen::MatrixXd& block : blocks) {
    all.middleRows(at, block.rows()) = block;
    at += block.rows();
  }
  return criterion_value(Criterion::bayes_a, all, importance, 1.0) / m;
}

}  // namespace gonio::design
