#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "gonio/calibration/result/estimate.h"
#include "gonio/instrument/calibration_archive.h"

namespace gonio::calibration::routine {

/// Gathers the parameters of a step with their covariance, block by block.
class ResultBuilder {
 public:
  explicit ResultBuilder(const std::string& step) { result_.step = step; }

  void parameter(const std::string& name, const std::string& unit, const Estimate& estimate);
  /// Uncorrelated with what came before, correlated among themselves. `scale` is what values and
  /// sigmas are multiplied by to come into `unit` (1 / kDegree for radians).
  struct Named {
    std::string name;
    std::string unit;
    double value;
    double scale = 1.0;
  };
  void block(const std::vector<Named>& parameters, const Eigen::MatrixXd& covariance);

  void residual(const std::string& name, double value) { result_.residuals[name] = value; }
  void check(const std::string& name, double found, double limit);
  void check(const instrument::AcceptanceCheck& check);
  void note(const std::string& text) { result_.notes.push_back(text); }
  void notes(const std::vector<std::string>& texts);

  instrument::StepResult take() { return std::move(result_); }

 private:
  instrument::StepResult result_;
};

inline constexpr double kDegPerRad = 57.29577951308232;

}  // namespace gonio::calibration::routine
