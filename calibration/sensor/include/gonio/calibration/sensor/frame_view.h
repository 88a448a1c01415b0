#pragma once

#include <cstdint>
#include <span>

namespace gonio::calibration::sensor {

/// One raw frame, looked at and not owned.
struct FrameView {
  std::span<const std::uint16_t> pixels_dn;  ///< row-major from the top left
  int width_px = 0;
  int height_px = 0;
  double exposure_s = 0.0;  ///< what the camera says it applied
};

/// Part of an image.
struct Region {
  int column = 0;  ///< of the top left pixel
  int row = 0;
  int width_px = 0;   ///< 0: to the right border
  int height_px = 0;  ///< 0: to the bottom
  int step = 1;       ///< every step-th column and row; 2 picks one colour of a Bayer mosaic
};

}  // namespace gonio::calibration::sensor
