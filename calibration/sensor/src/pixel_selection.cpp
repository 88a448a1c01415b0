#include "pixel_selection.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "gonio/calibration/result/step_refused.h"

namespace gonio::calibration::sensor {

std::vector<SelectedPixel> selected_pixels(const char* step, const Region& region, int width_px,
                                           int height_px, std::span<const std::uint8_t> bad_pixels,
                                           std::size_t min_pixels) {
  const bool starts_inside = region.column >= 0 && region.row >= 0 && region.column < width_px &&
                             region.row < height_px && region.step >= 1;
  if (!starts_inside || region.width_px < 0 || region.height_px < 0 ||
      region.width_px > width_px - region.column || region.height_px > height_px - region.row) {
    throw std::invalid_argument(fmt::format(
        "{}: region of {} x {} at ({}, {}), step {}, expected within the image of {} x {}", step,
        region.width_px, region.height_px, region.column, region.row, region.step, width_px,
        height_px));
  }
  const auto pixels = static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px);
  if (!bad_pixels.empty() && bad_pixels.size() != pixels) {
    throw std::invalid_argument(
        fmt::format("{}: a mask of {} pixels, expected {}", step, bad_pixels.size(), pixels));
  }
  const int end_column = region.width_px > 0 ? region.column + region.width_px : width_px;
  const int end_row = region.height_px > 0 ? region.row + region.height_px : height_px;
  std::vector<SelectedPixel> selected;
  for (int row = region.row; row < end_row; row += region.step) {
    for (int column = region.column; column < end_column; column += region.step) {
      const auto index = static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(width_px) +
                         static_cast<std::uint32_t>(column);
      if (!bad_pixels.empty() && bad_pixels[index] != 0) continue;
      selected.push_back(
          {index, static_cast<std::uint16_t>(column), static_cast<std::uint16_t>(row)});
    }
  }
  if (selected.size() < min_pixels) {
    throw StepRefused(fmt::format(
        "{}: {} good pixels in the region, expected at least {}: choose a larger region", step,
        selected.size(), min_pixels));
  }
  return selected;
}

void check_frame(const char* step, const FrameView& frame) {
  constexpr int kMaxPx = 65536;
  if (frame.width_px < 1 || frame.height_px < 1 || frame.width_px > kMaxPx ||
      frame.height_px > kMaxPx ||
      frame.pixels_dn.size() !=
          static_cast<std::size_t>(frame.width_px) * static_cast<std::size_t>(frame.height_px)) {
    throw StepRefused(
        fmt::format("{}: a frame of {} x {} has {} pixels, expected their product: take it again",
                    step, frame.width_px, frame.height_px, frame.pixels_dn.size()));
  }
  if (!(frame.exposure_s >= 0.0) || !std::isfinite(frame.exposure_s)) {
    throw StepRefused(
        fmt::format("{}: a frame of {} s, expected a time of 0 or more: the camera "
                    "does not report its exposure",
                    step, frame.exposure_s));
  }
}

}  // namespace gonio::calibration::sensor
