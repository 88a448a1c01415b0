#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "gonio/calibration/result/estimate.h"
#include "gonio/calibration/sensor/level_statistics.h"
#include "gonio/instrument/acceptance_check.h"
#include "gonio/instrument/response_curve.h"

namespace gonio::calibration::sensor {

struct LinearityOptions {
  double saturation_dn = 4095.0;
  int correction_terms = 2;     ///< 1: c1 alone; 2: c1 and c2
  std::size_t min_levels = 8;   ///< between 5 and 95 % of saturation
  double light_sigma = 2e-4;    ///< relative, of the lamp from level to level
  double max_le_percent = 1.0;  ///< acceptance
};

struct LinearityPoint {
  double exposure_s = 0.0;
  double signal_dn = 0.0;            ///< above dark
  double deviation_percent = 0.0;    ///< from the line of EMVA 1288
  double after_curve_percent = 0.0;  ///< from rate * (t + shutter offset), curve applied
  bool in_range = false;             ///< 5 to 95 % of saturation: counts for LE
};

struct Linearity {
  double le_percent = 0.0;           ///< mean |deviation|, EMVA 1288
  double after_curve_percent = 0.0;  ///< mean |deviation| with the curve applied
  Estimate shutter_offset_s;         ///< light falls for t + offset
  Estimate rate_dn_per_s;            ///< at low signal
  instrument::ResponseCurve curve;
  /// Of rate (DN/s), shutter offset (s), c1, c2; c2 row and column 0 with one correction term.
  Eigen::Matrix4d covariance;
  double chi2_per_dof = 0.0;  ///< above 1 the covariance is widened by it
  std::vector<LinearityPoint> points;
  instrument::AcceptanceCheck acceptance;  ///< LE
};

/// Linearity error, shutter offset and correction curve from a sweep of exposures under constant
/// light.
///
/// Method   y = rate (t + dt) - y (c1 u + c2 u^2), linear in rate, rate dt, c1 and c2, by relative
///          weights, over all levels below 95 % of saturation; short exposures tell the offset,
///          bright ones the curve. LE by the line with least relative deviations.
/// Input    `dark`: one level at least; `levels` with rising exposure.
/// Threads  Any.
/// Errors   StepRefused: exposures that do not rise, a signal that falls as they rise, the lamp
/// off,
///          too few levels between 5 and 95 %, saturated ones named. std::invalid_argument:
///          correction_terms other than 1 or 2.
/// Source   EMVA 1288 R4.0 Linear, section 6.7 (linearity error).
Linearity fit_linearity(std::span<const LevelStatistics> dark,
                        std::span<const LevelStatistics> levels, const LinearityOptions& options);

}  // namespace gonio::calibration::sensor
