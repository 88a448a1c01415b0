#pragma once

#include <cstdint>
#include <span>

#include "gonio/calibration/board/board_spec.h"
#include "gonio/calibration/geometry/board_view.h"

namespace gonio::calibration::board {

/// A frame as the sensor gave it.
struct BoardImage {
  std::span<const std::uint16_t> pixels_dn;  ///< row-major from the top left
  int width_px = 0;
  int height_px = 0;
  double saturation_dn = 0.0;  ///< a pixel at or above it carries no value
  /// Not 0: a pixel that carries no value, as instrument::bad_pixel_mask(). Empty: none is known.
  std::span<const std::uint8_t> bad_pixels = {};
};

/// Corners of the board, refined to a fraction of a pixel; those that are hidden, at the edge of
/// the picture or not as sharp as the others are left out. Bad and saturated pixels move none.
///
/// Threads  Any; OpenCV runs on the caller's thread alone.
/// Errors   StepRefused: no board, fewer than 60 % of its corners left and why, overexposed, too
///          dark. std::invalid_argument: pixels or a mask that do not make the size, a board that
///          is none.
/// Source   Garrido-Jurado et al., Pattern Recognition 47, 2014 (markers); OpenCV 4.6
///          cv::aruco::interpolateCornersCharuco, which leaves half a pixel, and cornerSubPix after
///          it; then a model of the picture about each corner, 0.015 px rms in simulated frames.
geometry::BoardView detect(const BoardImage& image, const BoardSpec& spec);

}  // namespace gonio::calibration::board
