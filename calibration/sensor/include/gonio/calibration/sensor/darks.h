#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "gonio/calibration/result/estimate.h"
#include "gonio/calibration/sensor/pixel_stack.h"
#include "gonio/instrument/acceptance_check.h"

namespace gonio::calibration::sensor {

/// Why a pixel is not to be used; bits of a mask.
namespace defect {
inline constexpr std::uint8_t kHot = 1;   ///< dark current far above the others'
inline constexpr std::uint8_t kCold = 2;  ///< response below half or above 1.5 of its neighbours'
inline constexpr std::uint8_t kBlinking = 4;  ///< temporal noise far above the others' (RTS)
}  // namespace defect

struct DarkOptions {
  std::size_t min_frames = 8;  ///< per exposure
  double mad_sigmas = 6.0;     ///< beyond the median by this times 1.4826 MAD: hot, blinking
  /// Dark current that is hot whatever the others do; DN/s. 0: no such limit.
  double hot_dn_per_s = 0.0;
  /// Takes the shot noise of a hot pixel off before it is called blinking. 0: not known.
  double gain_dn_per_e = 0.0;
  double max_black_change_dn = 0.1;  ///< acceptance
  double max_bad_fraction = 0.001;   ///< acceptance
};

/// Dark signal of every pixel, offset + current * exposure, and what the sensor as a whole does.
struct Darks {
  int width_px = 0;
  int height_px = 0;
  std::vector<float> offset_dn;
  std::vector<float> current_dn_per_s;
  std::vector<float> noise_dn;  ///< temporal sd of one frame, shortest exposure
  /// Times noise_dn^2 of a pixel: covariance of its offset (DN) and current (DN/s). Subtracting
  /// them is an error common to all frames of a session.
  Eigen::Matrix2d covariance_per_noise2;
  std::vector<std::uint8_t> defects;  ///< bits of `defect`, hot and blinking
  double bad_fraction = 0.0;

  Estimate black_level_dn;         ///< median of the offsets
  Estimate dark_current_dn_per_s;  ///< median over the pixels
  Estimate temporal_noise_dn;      ///< rms over good pixels at no exposure, quantisation included
  /// Over good pixels, growth of the mean and of the temporal variance with exposure. In electrons
  /// (/ K, / K^2) they agree unless the camera compensates its offset.
  Estimate mean_rate_dn_per_s;
  Estimate variance_rate_dn2_per_s;

  std::vector<instrument::AcceptanceCheck> acceptance;  ///< black level stability, bad pixels
};

/// Offset, dark current, noise and bad pixels from stacks of dark frames at several exposures.
///
/// Threads  Any.
/// Errors   StepRefused: fewer than two different exposures, stacks of differing size, too few
///          frames, exposures that do not rise, pixels at 0 (the black level is clipped), a frame
///          5 DN off its stack (light came in).
/// Source   EMVA 1288 R4.0 Linear, section 7 (dark current); median and MAD: Rousseeuw and Croux,
///          JASA 88, 1993.
Darks fit_darks(std::span<const PixelStack> stacks, const DarkOptions& options);

/// Marks pixels whose response in a flat image is below half or above 1.5 of the median of the 5 x
/// 5 around them. `signal_dn`  Above dark. `step`  2 compares within one colour of a Bayer mosaic.
/// Errors       StepRefused: no signal (lamp off). std::invalid_argument: a size that does not fit.
std::vector<std::uint8_t> flat_defects(std::span<const double> signal_dn, int width_px,
                                       int height_px, int step = 1);

}  // namespace gonio::calibration::sensor
