#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "gonio/calibration/result/estimate.h"
#include "gonio/calibration/sensor/level_statistics.h"
#include "gonio/instrument/response_curve.h"

namespace gonio::calibration::sensor {

struct PhotonTransferOptions {
  double saturation_dn = 4095.0;  ///< the camera's own; what the levels show may lie below
  double fit_limit = 0.7;         ///< of the saturation signal
  std::size_t min_levels = 6;     ///< within the fit
  /// The sensor's bend, if linearity was measured. Without it the curvature of the fit takes up
  /// most: 0.3 % of nonlinearity leaves a bias of 0.1 % on the gain.
  std::optional<instrument::ResponseCurve> response = std::nullopt;
  /// Adds the term c s^2, which nonlinearity and charge that spreads to neighbours cause. It
  /// doubles the gain's sigma; at 1 % of nonlinearity a straight line is off by 0.7 %, this by
  /// 0.25.
  bool curved = true;
};

struct PhotonTransferPoint {
  double exposure_s = 0.0;
  double signal_dn = 0.0;     ///< above black
  double variance_dn2 = 0.0;  ///< temporal; linearised, as the signal, if a response was given
  double fitted_dn2 = 0.0;
  bool used = false;
};

struct PhotonTransfer {
  Estimate gain_dn_per_e;
  Estimate read_noise_e;       ///< without quantisation and dark current's shot noise
  Eigen::Matrix2d covariance;  ///< of gain (DN/e) and read noise (e)
  /// The dark variance is below 0.24 DN^2: quantisation hides the read noise, whose value is then
  /// an upper bound.
  bool read_noise_is_bound = false;
  Estimate black_level_dn;  ///< mean of a dark frame of no exposure
  /// Of the levels' mean signals: slope of the dark mean over exposure.
  Estimate dark_rate_dn_per_s;  ///< 0 with sigma 0 when all dark levels have one exposure

  /// Level where the variance peaks; with `saturation_reached` false only a bound: the highest
  /// level seen. Uncertain by the spacing of the levels.
  bool saturation_reached = false;
  Estimate saturation_dn;  ///< DN as in a frame, black included
  Estimate saturation_e;
  /// Electrons at the level above which nothing rises any more, by full well or converter; none
  /// when no level reached it.
  std::optional<Estimate> full_well_e;

  Estimate snr_max;
  Estimate threshold_e;    ///< absolute sensitivity threshold, SNR 1
  Estimate dynamic_range;  ///< saturation over threshold, a ratio

  /// rms relative change of the light from the first frame of a pair to the second, shot noise
  /// taken off. A lamp that is pulsed shows here.
  double light_noise = 0.0;
  double chi2_per_dof = 0.0;                ///< above 1 the sigmas are widened by its root
  std::vector<PhotonTransferPoint> points;  ///< ascending in signal, dark levels first
};

/// Gain, read noise and capacity from the growth of temporal variance with the mean.
///
/// Method   variance = v0 + K s + c s^2 over dark and bright levels at once, s the mean above the
///          dark mean of no exposure; weights 1/var^2 from the fit (a sample variance has the
///          variance 2 var^2/N). Electrons of dark current count as signal, which they are, so
///          that v0 is free of their shot noise. read noise = sqrt(v0 - 1/12) / K.
/// Input    `dark` with the shutter closed, one level at least, best at the shortest and the
///          longest exposure; `levels` at any exposures and light, in any order, about 20 up to
///          beyond saturation.
/// Threads  Any.
/// Errors   StepRefused: no dark level, darks with light in or clipped at 0, the lamp off, too few
///          levels or all of them far below saturation, variances that do not grow with the mean.
/// Source   EMVA 1288 R4.0 Linear, sections 2 and 6; Janesick, "Photon Transfer", SPIE 2007.
PhotonTransfer fit_photon_transfer(std::span<const LevelStatistics> dark,
                                   std::span<const LevelStatistics> levels,
                                   const PhotonTransferOptions& options);

}  // namespace gonio::calibration::sensor
