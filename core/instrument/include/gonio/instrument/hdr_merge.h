#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gonio/instrument/instrument.h"

namespace gonio::instrument {

/// One frame of a bracket: row-major DN, all frames of a bracket of the same size.
struct Exposure {
  std::span<const std::uint16_t> pixels_dn;
  double exposure_s = 0.0;
};

/// What a pixel of a merged bracket is worth. Saturated and too dark are bounds, never values.
enum class PixelState : std::uint8_t {
  measured,
  saturated,      ///< even the shortest exposure is full, or next to a full pixel
  black_clipped,  ///< a zero in every usable exposure: the black level is too low to tell
  defective       ///< one of the sensor's bad pixels
};

/// Per pixel: signal above dark in DN/s that a straight sensor would have given and its variance
/// from shot, read and quantisation noise.
struct MergedSignal {
  std::vector<double> dn_per_s;
  std::vector<double> variance;
  std::vector<PixelState> state;
};

/// What to subtract from each frame: offset + rate * exposure, from dark and lamp-off frames.
/// Empty spans: the sensor's black level and dark current.
struct Background {
  std::span<const double> offset_dn;
  std::span<const double> rate_dn_per_s;
};

/// Merges a bracket by inverse variance, the weights computed from the current estimate and
/// iterated: weights from the noisy data would bias by -4.6 % at ten electrons.
/// Which exposures of a pixel are used is decided from the prediction of the shorter ones
/// (prediction + 4 sigma below 95 % of saturation), so that a pixel at the threshold is not
/// selected by its own noise; neighbours within 2 px of a saturated pixel are left out (blooming),
/// unless that one is a bad pixel. Signals above the offset go through the sensor's response curve;
/// an exposure, also that of a background's rate, lasts for its time plus the shutter offset. Shot
/// noise is that of charge, which came before the curve.
///
/// Throws   std::invalid_argument for no exposure, sizes that differ, a bad pixel outside the
///          frames, or an exposure that with the shutter offset is not above 0.
/// Source   Granados et al., CVPR 2010, for iterated optimal weights; EMVA 1288 R4.0 noise model.
MergedSignal merge_bracket(const SensorModel& sensor, std::span<const Exposure> bracket,
                           int width_px, const Background& background = {});

}  // namespace gonio::instrument
