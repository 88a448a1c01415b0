#pragma once

#include <array>
#include <cstdint>

#include "gonio/devices/frame.h"
#include "gonio/render/image.h"

namespace gonio::monitor {

/// What a frame's numbers say at a glance.
struct FrameFigures {
  static constexpr int kBins = 64;

  double mean_dn = 0.0;
  std::uint16_t min_dn = 0;
  std::uint16_t max_dn = 0;
  double saturated_share = 0.0;  ///< of all pixels, at or above the saturation level
  /// Pixels by value in equal bins from 0 to the saturation level; saturated ones in the last.
  std::array<std::uint32_t, kBins> histogram{};
};

/// A rectangle of a frame, in pixels from its top left.
struct Region {
  int column = 0;
  int row = 0;
  int width_px = 0;
  int height_px = 0;

  bool operator==(const Region&) const = default;
};

/// The part of `wanted` that lies in the frame; the whole frame when none does.
Region clipped(const Region& wanted, const devices::Frame& frame);

/// Of a part of a frame that has pixels.
FrameFigures figures_of(const devices::Frame& frame, const Region& region);
FrameFigures figures_of(const devices::Frame& frame);

/// The frame from black level to saturation as a person looks at it: square root for the eye; red
/// where a pixel is saturated. Wider than `max_width_px`: means over squares of pixels, red where
/// one of them is saturated.
render::Image frame_picture(const devices::Frame& frame, int max_width_px);

/// How sharp a region is: the mean square of differences between pixels two columns or two rows
/// apart (so within one colour of a Bayer frame), over the squared mean above the black level. The
/// sharper the larger; it does not change with the light but grows with noise, so that it compares
/// frames of one exposure. 0 where the mean light is below 1 % of the range, or with
/// less than 3 x 3 px.
/// Source   Brenner et al., "An Automated Microscope for Cytologic Research", J. Histochem.
///          Cytochem. 24(1), 1976, along both axes, normalised by the mean.
double focus_of(const devices::Frame& frame, const Region& region);

}  // namespace gonio::monitor
