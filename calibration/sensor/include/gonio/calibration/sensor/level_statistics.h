#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "gonio/calibration/result/estimate.h"
#include "gonio/calibration/sensor/frame_view.h"

namespace gonio::calibration::sensor {

struct LevelOptions {
  Region region = {};
  std::span<const std::uint8_t> bad_pixels =
      {};                         ///< of the whole image, not 0: left out; empty: none
  double saturation_dn = 4095.0;  ///< at or above it a pixel carries no value
};

/// What two frames of one scene say about one light level. Frames need not be kept: sweeps are made
/// of these.
struct LevelStatistics {
  double exposure_s = 0.0;
  Estimate mean_dn;       ///< of both frames; sigma from the temporal noise alone
  Estimate variance_dn2;  ///< temporal, per pixel and frame, quantisation included
  /// Second frame minus first. More than noise explains means light that is not constant.
  double mean_difference_dn = 0.0;
  double saturated_fraction = 0.0;  ///< of the pixels, in either frame
  double black_fraction = 0.0;      ///< of the pixels, 0 DN in either frame
  std::size_t pixels = 0;
};

/// Mean and temporal variance of a pair. The difference of the two frames has no fixed pattern, and
/// a common step of the light is taken out, so shading, PRNU and DSNU do not matter. Works across a
/// Bayer mosaic too: both are linear in the signal.
///
/// Threads  Any.
/// Errors   StepRefused: frames of different size or exposure, an exposure that is none, pixels
/// that
///          do not make the frame, identical frames (one buffer delivered twice), a scene that
///          changed in between (the mean, or any sixteenth of the region, by more than 6 sigma and
///          2 % of the level), fewer than 256 pixels left by the mask. std::invalid_argument: a
///          region outside the image, a mask of another size.
/// Source   EMVA 1288 R4.0 Linear, section 6.6 (two images per level).
LevelStatistics level_statistics(const FrameView& first, const FrameView& second,
                                 const LevelOptions& options);

}  // namespace gonio::calibration::sensor
