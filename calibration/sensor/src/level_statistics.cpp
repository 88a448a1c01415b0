#include "gonio/calibration/sensor/level_statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"
#include "pixel_selection.h"

namespace gonio::calibration::sensor {
namespace {

constexpr const char* kLevelStep = "light level";
constexpr int kBlocksAcross = 4;
constexpr double kChangeSigmas = 6.0;
constexpr double kChangeShare = 0.02;  // of the level: a lamp may flicker by less

void require_same_shape(const FrameView& first, const FrameView& second) {
  if (first.width_px != second.width_px || first.height_px != second.height_px) {
    throw StepRefused(fmt::format(
        "{}: frames of {} x {} and {} x {}, expected one size: do not change the camera's window "
        "in "
        "between",
        kLevelStep, first.width_px, first.height_px, second.width_px, second.height_px));
  }
  if (first.exposure_s != second.exposure_s) {
    throw StepRefused(
        fmt::format("{}: exposures of {} and {} s in one pair, expected the same: take it again",
                    kLevelStep, first.exposure_s, second.exposure_s));
  }
}

/// Sums of the difference of the two frames over a sixteenth of the region.
struct Block {
  double difference = 0.0;
  double count = 0.0;
};

class Changes {
 public:
  Changes(double pixel_variance, double level) : pixel_variance_(pixel_variance), level_(level) {}

  bool beyond(double mean_difference, double pixels) const {
    const double sigma = std::sqrt(2.0 * pixel_variance_ / pixels);
    return std::abs(mean_difference) > kChangeSigmas * sigma &&
           std::abs(mean_difference) > kChangeShare * level_;
  }

 private:
  double pixel_variance_;
  double level_;
};

}  // namespace

LevelStatistics level_statistics(const FrameView& first, const FrameView& second,
                                 const LevelOptions& options) {
  check_frame(kLevelStep, first);
  check_frame(kLevelStep, second);
  require_same_shape(first, second);
  const auto pixels = selected_pixels(kLevelStep, options.region, first.width_px, first.height_px,
                                      options.bad_pixels);
  const int width = pixels.back().column - options.region.column + 1;
  const int height = pixels.back().row - options.region.row + 1;

  std::uint64_t sum_first = 0;
  std::uint64_t sum_second = 0;
  std::size_t saturated = 0;
  std::size_t black = 0;
  bool identical = true;
  std::array<Block, static_cast<std::size_t>(kBlocksAcross) * kBlocksAcross> blocks;
  for (const SelectedPixel& pixel : pixels) {
    const std::uint16_t a = first.pixels_dn[pixel.index];
    const std::uint16_t b = second.pixels_dn[pixel.index];
    sum_first += a;
    sum_second += b;
    identical = identical && a == b;
    if (std::max(a, b) >= options.saturation_dn) ++saturated;
    if (std::min(a, b) == 0) ++black;
    const int across =
        std::min(kBlocksAcross - 1, (pixel.column - options.region.column) * kBlocksAcross / width);
    const int down =
        std::min(kBlocksAcross - 1, (pixel.row - options.region.row) * kBlocksAcross / height);
    Block& block = blocks[static_cast<std::size_t>(down * kBlocksAcross + across)];
    block.difference += static_cast<double>(b) - static_cast<double>(a);
    block.count += 1.0;
  }
  const auto count = static_cast<double>(pixels.size());

  LevelStatistics level;
  level.exposure_s = first.exposure_s;
  level.pixels = pixels.size();
  level.saturated_fraction = static_cast<double>(saturated) / count;
  level.black_fraction = static_cast<double>(black) / count;
  level.mean_difference_dn =
      (static_cast<double>(sum_second) - static_cast<double>(sum_first)) / count;
  if (identical && level.saturated_fraction < 0.5) {
    throw StepRefused(
        fmt::format("{}: two frames of {} s are the same in every pixel, expected "
                    "noise: the camera delivered one twice; take the pair again",
                    kLevelStep, first.exposure_s));
  }

  double squares = 0.0;
  double fourths = 0.0;
  for (const SelectedPixel& pixel : pixels) {
    const double difference = static_cast<double>(second.pixels_dn[pixel.index]) -
                              static_cast<double>(first.pixels_dn[pixel.index]) -
                              level.mean_difference_dn;
    const double half_square = 0.5 * difference * difference;
    squares += half_square;
    fourths += half_square * half_square;
  }
  const double variance = squares / (count - 1.0);
  const double spread = std::max(0.0, fourths / count - std::pow(squares / count, 2.0));
  level.variance_dn2 = {variance, std::sqrt(spread / count)};
  level.mean_dn = {0.5 * (static_cast<double>(sum_first) + static_cast<double>(sum_second)) / count,
                   std::sqrt(variance / (2.0 * count))};

  const Changes changes(variance, level.mean_dn.value);
  if (changes.beyond(level.mean_difference_dn, count)) {
    throw StepRefused(fmt::format(
        "{}: the mean went from {:.1f} to {:.1f} DN between two frames of {} s, expected the same: "
        "let the lamp warm up, keep other light out and take the pair again",
        kLevelStep, static_cast<double>(sum_first) / count, static_cast<double>(sum_second) / count,
        first.exposure_s));
  }
  for (const Block& block : blocks) {
    if (block.count > 1.0 && changes.beyond(block.difference / block.count, block.count)) {
      throw StepRefused(fmt::format(
          "{}: a part of the scene changed by {:.1f} DN between two frames of {} s, expected the "
          "same scene: let nothing move and take the pair again",
          kLevelStep, block.difference / block.count, first.exposure_s));
    }
  }
  return level;
}

}  // namespace gonio::calibration::sensor
