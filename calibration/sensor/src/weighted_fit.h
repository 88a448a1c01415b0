#pragma once

#include <Eigen/Core>
#include <span>

#include "gonio/calibration/result/estimate.h"
#include "gonio/calibration/sensor/level_statistics.h"

namespace gonio::calibration::sensor {

/// y = design * parameters, each y with its own standard deviation.
struct WeightedFit {
  Eigen::VectorXd parameters;
  Eigen::MatrixXd covariance;  ///< from the sigmas given
  Eigen::VectorXd fitted;
  double chi2 = 0.0;
  Eigen::Index degrees_of_freedom = 0;

  /// chi2 per degree of freedom; 1 where there is none to tell.
  double chi2_per_dof() const;
  /// What to multiply the covariance by: never below 1, as few points often fit too well.
  double widening() const;
};

/// Throws NumericalError when the points do not determine the parameters.
WeightedFit weighted_fit(const Eigen::MatrixXd& design, const Eigen::VectorXd& y,
                         const Eigen::VectorXd& sigma);

/// Mean of dark levels over exposure.
struct DarkLine {
  Estimate offset_dn;
  Estimate rate_dn_per_s;  ///< 0, sigma 0, when all levels have one exposure

  double at(double exposure_s) const { return offset_dn.value + rate_dn_per_s.value * exposure_s; }
};

/// Throws StepRefused, its message beginning with `step`: no level, light in a dark frame, pixels
/// clipped at 0.
DarkLine dark_line(const char* step, std::span<const LevelStatistics> dark, double saturation_dn);

/// Throws StepRefused unless the brightest of `levels` stands out of the dark.
void require_light(const char* step, std::span<const LevelStatistics> levels, const DarkLine& dark);

}  // namespace gonio::calibration::sensor
