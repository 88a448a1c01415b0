#include "result_builder.h"

#include <stdexcept>

namespace gonio::calibration::routine {

void ResultBuilder::parameter(const std::string& name, const std::string& unit,
                              const Estimate& estimate) {
  Eigen::MatrixXd variance(1, 1);
  variance << estimate.sigma * estimate.sigma;
  block({{name, unit, estimate.value}}, variance);
}

void ResultBuilder::block(const std::vector<Named>& parameters, const Eigen::MatrixXd& covariance) {
  const auto count = static_cast<Eigen::Index>(parameters.size());
  if (covariance.rows() != count || covariance.cols() != count) {
    throw std::logic_error("a covariance of another size than its parameters");
  }
  Eigen::VectorXd scale(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Named& named = parameters[static_cast<std::size_t>(i)];
    scale[i] = named.scale;
    result_.parameters.push_back({named.name, named.unit, named.scale * named.value});
  }
  const Eigen::Index before = result_.covariance.rows();
  Eigen::MatrixXd grown = Eigen::MatrixXd::Zero(before + count, before + count);
  grown.topLeftCorner(before, before) = result_.covariance;
  const Eigen::MatrixXd scaled = scale.asDiagonal() * covariance * scale.asDiagonal();
  grown.bottomRightCorner(count, count) = 0.5 * (scaled + scaled.transpose());
  result_.covariance = grown;
}

void ResultBuilder::check(const std::string& name, double found, double limit) {
  check({name, limit, found});
}

void ResultBuilder::check(const instrument::AcceptanceCheck& check) {
  result_.checks.push_back(check);
}

void ResultBuilder::notes(const std::vector<std::string>& texts) {
  result_.notes.insert(result_.notes.end(), texts.begin(), texts.end());
}

}  // namespace gonio::calibration::routine
