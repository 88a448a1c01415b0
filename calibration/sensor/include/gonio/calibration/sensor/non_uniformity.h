#pragma once

#include <cstdint>
#include <span>

#include "gonio/calibration/result/estimate.h"
#include "gonio/calibration/sensor/pixel_stack.h"

namespace gonio::calibration::sensor {

struct NonUniformity {
  Estimate dsnu_dn;  ///< divide by the gain for electrons; at the dark stack's exposure
  Estimate prnu;     ///< relative
  double bright_signal_dn = 0.0;
  std::size_t pixels = 0;
};

/// Spread of the pixels' offsets and responses.
///
/// Method   Spatial variance of the mean of L frames minus temporal variance / L. The response is
///          taken from the difference of bright and dark means pixel by pixel, which removes the
///          offsets themselves and not only their variance. A surface of second order is taken off
///          first: shading is not PRNU.
/// Input    Dark and bright stacks of one exposure; bright at about half saturation.
/// Threads  Any.
/// Errors   StepRefused: stacks of differing size or exposure, fewer than 8 frames, no signal above
///          dark, light that changed by more than 2 % within the bright stack, too few pixels.
///          std::invalid_argument as level_statistics().
/// Source   EMVA 1288 R4.0 Linear, section 8 (spatial nonuniformity; there a highpass filter).
NonUniformity fit_non_uniformity(const PixelStack& dark, const PixelStack& bright,
                                 const Region& region = {},
                                 std::span<const std::uint8_t> bad_pixels = {});

}  // namespace gonio::calibration::sensor
