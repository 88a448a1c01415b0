#pragma once

#include <Eigen/Core>
#include <span>

#include "gonio/calibration/result/estimate.h"
#include "gonio/instrument/acceptance_check.h"

namespace gonio::calibration::sensor {

struct LampReading {
  double time_s = 0.0;  ///< since it was switched on
  double value = 0.0;   ///< white patch or monitor, above dark, any unit
};

struct LampOptions {
  double max_drift_per_10_min = 0.002;  ///< relative: warm below it, and acceptance
};

struct LampStability {
  /// value = level (1 - amplitude exp(-t / tau)).
  Estimate level;
  Estimate amplitude;          ///< relative
  Estimate tau_s;              ///< no meaning when already_warm
  Eigen::Matrix3d covariance;  ///< of level, amplitude, tau
  bool already_warm = false;   ///< the amplitude is lost in the noise
  Estimate warm_after_s;       ///< when the remaining drift is below the limit; 0 when at once
  Estimate drift_per_10_min;   ///< relative, over the last sixth of the series, at least 10 min
  double sigma = 0.0;          ///< relative sd of the readings about the fit
  /// Readings per independent one: slow wander of a lamp makes neighbours alike, and widens all
  /// sigmas by its root.
  double correlation = 1.0;
  instrument::AcceptanceCheck acceptance;  ///< drift
};

/// Warm-up and drift of a lamp from readings since it was lit.
///
/// Threads  Any.
/// Errors   StepRefused: fewer than 20 readings, times that do not rise, less than 20 minutes,
///          readings that are no numbers or not positive (lamp off), a warm-up much longer than the
///          record.
LampStability fit_lamp_stability(std::span<const LampReading> readings,
                                 const LampOptions& options = {});

}  // namespace gonio::calibration::sensor
