#include "gonio/monitor/frame_picture.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gonio::monitor {
namespace {

constexpr double kLeastLight = 0.01;  // of the range; below, the noise would look sharp
constexpr render::Rgba8 kSaturatedColour{230, 30, 30, 255};

}  // namespace

Region clipped(const Region& wanted, const devices::Frame& frame) {
  // In 64 bits: what a stranger asks for may lie anywhere.
  const auto overlap = [](std::int64_t first, std::int64_t length, int end) {
    const std::int64_t from = std::clamp<std::int64_t>(first, 0, end);
    const std::int64_t to =
        std::clamp<std::int64_t>(first + std::max<std::int64_t>(length, 0), 0, end);
    return std::pair(static_cast<int>(from),
                     static_cast<int>(std::max<std::int64_t>(to - from, 0)));
  };
  const auto [column, width] = overlap(wanted.column, wanted.width_px, frame.width_px);
  const auto [row, height] = overlap(wanted.row, wanted.height_px, frame.height_px);
  if (width == 0 || height == 0) return {0, 0, frame.width_px, frame.height_px};
  return {column, row, width, height};
}

FrameFigures figures_of(const devices::Frame& frame, const Region& region) {
  FrameFigures figures;
  figures.min_dn = std::numeric_limits<std::uint16_t>::max();
  const int saturation = std::max<int>(1, frame.saturation_level_dn);
  std::uint64_t sum = 0;
  std::uint64_t saturated = 0;
  for (int y = region.row; y < region.row + region.height_px; ++y) {
    for (int x = region.column; x < region.column + region.width_px; ++x) {
      const std::uint16_t dn = frame.at(y, x);
      sum += dn;
      figures.min_dn = std::min(figures.min_dn, dn);
      figures.max_dn = std::max(figures.max_dn, dn);
      if (dn >= frame.saturation_level_dn) ++saturated;
      const int bin = std::min(dn * FrameFigures::kBins / saturation, FrameFigures::kBins - 1);
      ++figures.histogram[static_cast<std::size_t>(bin)];
    }
  }
  const double count = static_cast<double>(region.width_px) * region.height_px;
  figures.mean_dn = static_cast<double>(sum) / count;
  figures.saturated_share = static_cast<double>(saturated) / count;
  return figures;
}

FrameFigures figures_of(const devices::Frame& frame) {
  return figures_of(frame, {0, 0, frame.width_px, frame.height_px});
}

render::Image frame_picture(const devices::Frame& frame, int max_width_px) {
  const int step = (frame.width_px + max_width_px - 1) / max_width_px;
  render::Image image((frame.width_px + step - 1) / step, (frame.height_px + step - 1) / step);
  const double range = std::max(1.0, frame.saturation_level_dn - frame.black_level_dn);
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      const int last_row = std::min((y + 1) * step, frame.height_px);
      const int last_column = std::min((x + 1) * step, frame.width_px);
      std::uint64_t sum = 0;
      std::uint16_t brightest = 0;
      for (int row = y * step; row < last_row; ++row) {
        for (int column = x * step; column < last_column; ++column) {
          const std::uint16_t dn = frame.at(row, column);
          sum += dn;
          brightest = std::max(brightest, dn);
        }
      }
      if (brightest >= frame.saturation_level_dn) {
        image.at(x, y) = kSaturatedColour;
        continue;
      }
      const double mean =
          static_cast<double>(sum) / ((last_row - y * step) * (last_column - x * step));
      const double level = std::clamp((mean - frame.black_level_dn) / range, 0.0, 1.0);
      const auto grey = static_cast<std::uint8_t>(std::lround(255.0 * std::sqrt(level)));
      image.at(x, y) = {grey, grey, grey, 255};
    }
  }
  return image;
}

double focus_of(const devices::Frame& frame, const Region& region) {
  constexpr int kApart = 2;
  if (region.width_px <= kApart || region.height_px <= kApart) return 0.0;
  double squares = 0.0;
  double sum = 0.0;
  std::int64_t pairs = 0;
  const int end_row = region.row + region.height_px;
  const int end_column = region.column + region.width_px;
  for (int y = region.row; y < end_row; ++y) {
    for (int x = region.column; x < end_column; ++x) {
      const double dn = frame.at(y, x);
      sum += dn;
      if (x + kApart < end_column) {
        const double along = frame.at(y, x + kApart) - dn;
        squares += along * along;
        ++pairs;
      }
      if (y + kApart < end_row) {
        const double down = frame.at(y + kApart, x) - dn;
        squares += down * down;
        ++pairs;
      }
    }
  }
  const double count = static_cast<double>(region.width_px) * region.height_px;
  const double light = sum / count - frame.black_level_dn;
  const double range = frame.saturation_level_dn - frame.black_level_dn;
  if (light <= kLeastLight * range) return 0.0;
  return squares / static_cast<double>(pairs) / (light * light);
}

}  // namespace gonio::monitor
