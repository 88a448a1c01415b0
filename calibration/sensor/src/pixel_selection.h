#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "gonio/calibration/sensor/frame_view.h"

namespace gonio::calibration::sensor {

/// A pixel of a region that is not masked out.
struct SelectedPixel {
  std::uint32_t index;  ///< into the row-major image
  std::uint16_t column;
  std::uint16_t row;
};

/// The pixels of a region, row by row.
/// Throws StepRefused, its message beginning with `step`: fewer than `min_pixels`.
/// Throws std::invalid_argument: a region outside the image, a mask of another size.
std::vector<SelectedPixel> selected_pixels(const char* step, const Region& region, int width_px,
                                           int height_px, std::span<const std::uint8_t> bad_pixels,
                                           std::size_t min_pixels = 256);

/// Throws StepRefused: a size that is none or not that of the pixels, an exposure that is none.
void check_frame(const char* step, const FrameView& frame);

}  // namespace gonio::calibration::sensor
