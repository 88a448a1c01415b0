#include "gonio/calibration/sensor/non_uniformity.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"
#include "pixel_selection.h"

namespace gonio::calibration::sensor {
namespace {

constexpr const char* kUniformityStep = "non-uniformity";
constexpr int kSurfaceTerms = 6;
using SurfaceTerms = Eigen::Matrix<double, kSurfaceTerms, 1>;

/// Terms of a surface of second order over the region, coordinates about -1 to 1.
class Surface {
 public:
  explicit Surface(const std::vector<SelectedPixel>& pixels)
      : middle_column_(0.5 * (pixels.front().column + pixels.back().column)),
        middle_row_(0.5 * (pixels.front().row + pixels.back().row)),
        half_(std::max(
            {1.0, middle_column_ - pixels.front().column, middle_row_ - pixels.front().row})) {}

  SurfaceTerms terms(const SelectedPixel& pixel) const {
    const double x = (pixel.column - middle_column_) / half_;
    const double y = (pixel.row - middle_row_) / half_;
    SurfaceTerms terms;
    terms << 1.0, x, y, x * x, x * y, y * y;
    return terms;
  }

  template <typename Value>
  SurfaceTerms fit(const std::vector<SelectedPixel>& pixels, const Value& value) const {
    Eigen::Matrix<double, kSurfaceTerms, kSurfaceTerms> normal;
    normal.setZero();
    SurfaceTerms right = SurfaceTerms::Zero();
    for (const SelectedPixel& pixel : pixels) {
      const SurfaceTerms row = terms(pixel);
      normal.noalias() += row * row.transpose();
      right += row * value(pixel.index);
    }
    return normal.ldlt().solve(right);
  }

 private:
  double middle_column_;
  double middle_row_;
  double half_;
};

/// Spread of the pixels once temporal noise is taken off.
Estimate spatial_sd(const std::vector<double>& residual, double temporal, double temporal_sigma) {
  const auto count = static_cast<double>(residual.size());
  double squares = 0.0;
  double fourths = 0.0;
  for (const double r : residual) {
    squares += r * r;
    fourths += r * r * r * r;
  }
  const double variance = squares / (count - kSurfaceTerms);
  // By the fourth moment: few pixels far out make the spread itself uncertain.
  const double spread = std::max(0.0, fourths / count - std::pow(squares / count, 2.0));
  const double sigma = std::hypot(std::sqrt(spread / count), temporal_sigma);
  const double excess = std::max(0.0, variance - temporal);
  const double sd = std::sqrt(excess);
  // Near zero the root has no slope to carry an uncertainty over.
  return {sd, excess > sigma ? sigma / (2.0 * sd) : std::sqrt(sigma)};
}

double mean_of_frames(const PixelStack& stack) {
  double sum = 0.0;
  for (const double mean : stack.frame_means_dn()) sum += mean;
  return sum / static_cast<double>(stack.frames());
}

/// Relative variance of the light from frame to frame: common to all pixels, so it is in the
/// temporal variance of each and not in the spatial variance.
double light_variance(const PixelStack& bright, double signal_dn) {
  const double mean = mean_of_frames(bright);
  double squares = 0.0;
  for (const double value : bright.frame_means_dn()) squares += (value - mean) * (value - mean);
  return squares / (static_cast<double>(bright.frames()) - 1.0) / (signal_dn * signal_dn);
}

void check_uniformity_stacks(const PixelStack& dark, const PixelStack& bright) {
  if (dark.width_px() != bright.width_px() || dark.height_px() != bright.height_px() ||
      dark.exposure_s() != bright.exposure_s()) {
    throw StepRefused(fmt::format(
        "{}: dark frames of {} x {}, {} s and bright ones of {} x {}, {} s, expected the same: "
        "take both alike",
        kUniformityStep, dark.width_px(), dark.height_px(), dark.exposure_s(), bright.width_px(),
        bright.height_px(), bright.exposure_s()));
  }
  constexpr std::size_t kFrames = 8;
  if (std::min(dark.frames(), bright.frames()) < kFrames) {
    throw StepRefused(
        fmt::format("{}: {} dark and {} bright frames, expected {} of each: take more",
                    kUniformityStep, dark.frames(), bright.frames(), kFrames));
  }
}

}  // namespace

NonUniformity fit_non_uniformity(const PixelStack& dark, const PixelStack& bright,
                                 const Region& region, std::span<const std::uint8_t> bad_pixels) {
  check_uniformity_stacks(dark, bright);
  const auto pixels =
      selected_pixels(kUniformityStep, region, dark.width_px(), dark.height_px(), bad_pixels);
  const auto count = static_cast<double>(pixels.size());
  const double overall_dn = mean_of_frames(bright) - mean_of_frames(dark);
  constexpr double kLit_dn = 5.0;
  if (!(overall_dn > kLit_dn)) {
    throw StepRefused(
        fmt::format("{}: the bright frames are {:.2f} DN above dark, expected about "
                    "half of saturation: the lamp is off or the shutter closed",
                    kUniformityStep, overall_dn));
  }
  const auto [lowest, highest] =
      std::minmax_element(bright.frame_means_dn().begin(), bright.frame_means_dn().end());
  constexpr double kSteady = 0.02;
  if (*highest - *lowest > kSteady * overall_dn) {
    throw StepRefused(fmt::format(
        "{}: the light changed by {:.1f} % within the bright frames, expected less than "
        "{:.0f} %: let the lamp warm up",
        kUniformityStep, 100.0 * (*highest - *lowest) / overall_dn, 100.0 * kSteady));
  }

  const Surface surface(pixels);
  const auto dark_frames = static_cast<double>(dark.frames());
  const auto bright_frames = static_cast<double>(bright.frames());
  const auto dark_mean = [&](std::size_t p) { return dark.mean_dn(p); };
  const auto signal = [&](std::size_t p) { return bright.mean_dn(p) - dark.mean_dn(p); };
  const SurfaceTerms dark_surface = surface.fit(pixels, dark_mean);
  const SurfaceTerms signal_surface = surface.fit(pixels, signal);
  const double flicker = light_variance(bright, overall_dn);

  NonUniformity result;
  result.pixels = pixels.size();
  std::vector<double> offsets;
  std::vector<double> responses;
  offsets.reserve(pixels.size());
  responses.reserve(pixels.size());
  double dark_temporal = 0.0;           // DN^2, of a mean of frames
  double relative_temporal_dark = 0.0;  // of the signal
  double relative_temporal_bright = 0.0;
  for (const SelectedPixel& pixel : pixels) {
    const SurfaceTerms terms = surface.terms(pixel);
    const double expected = terms.dot(signal_surface);
    if (!(expected > 0.0)) {
      throw StepRefused(
          fmt::format("{}: part of the region is dark, expected the white in all of "
                      "it: choose a smaller region",
                      kUniformityStep));
    }
    offsets.push_back(dark_mean(pixel.index) - terms.dot(dark_surface));
    responses.push_back(signal(pixel.index) / expected - 1.0);
    const double of_dark = dark.variance_dn2(pixel.index) / dark_frames;
    const double of_bright =
        (bright.variance_dn2(pixel.index) - flicker * expected * expected) / bright_frames;
    dark_temporal += of_dark / count;
    relative_temporal_dark += of_dark / (expected * expected) / count;
    relative_temporal_bright += of_bright / (expected * expected) / count;
    result.bright_signal_dn += expected / count;
  }
  const double dark_share = std::sqrt(2.0 / ((dark_frames - 1.0) * count));
  const double bright_share = std::sqrt(2.0 / ((bright_frames - 1.0) * count));
  result.dsnu_dn = spatial_sd(offsets, dark_temporal, dark_temporal * dark_share);
  result.prnu = spatial_sd(
      responses, relative_temporal_dark + relative_temporal_bright,
      std::hypot(relative_temporal_dark * dark_share, relative_temporal_bright * bright_share));
  return result;
}

}  // namespace gonio::calibration::sensor
