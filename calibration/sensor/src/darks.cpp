#include "gonio/calibration/sensor/darks.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/errors/errors.h"
#include "robust.h"
#include "weighted_fit.h"

namespace gonio::calibration::sensor {
namespace {

constexpr const char* kDarkStep = "darks";
constexpr double kMedianSigma = 1.2533;  // sd of a median over that of a mean, normal values

double mean_of(const std::vector<double>& values) {
  double sum = 0.0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

void check_stacks(std::span<const PixelStack> stacks, const DarkOptions& options) {
  if (stacks.size() < 2) {
    throw StepRefused(fmt::format(
        "{}: {} exposures, expected at least 2, the shortest and the longest of a session",
        kDarkStep, stacks.size()));
  }
  for (std::size_t k = 0; k < stacks.size(); ++k) {
    const PixelStack& stack = stacks[k];
    if (stack.width_px() != stacks[0].width_px() || stack.height_px() != stacks[0].height_px()) {
      throw StepRefused(
          fmt::format("{}: stacks of {} x {} and {} x {}, expected one size: do not "
                      "change the camera's window in between",
                      kDarkStep, stacks[0].width_px(), stacks[0].height_px(), stack.width_px(),
                      stack.height_px()));
    }
    if (k > 0 && !(stack.exposure_s() > stacks[k - 1].exposure_s())) {
      throw StepRefused(fmt::format("{}: exposure {} s follows {} s, expected rising exposures",
                                    kDarkStep, stack.exposure_s(), stacks[k - 1].exposure_s()));
    }
    if (stack.frames() < std::max<std::size_t>(2, options.min_frames)) {
      throw StepRefused(fmt::format("{}: {} frames of {} s, expected at least {}: take more",
                                    kDarkStep, stack.frames(), stack.exposure_s(),
                                    options.min_frames));
    }
    const double mean = mean_of(stack.frame_means_dn());
    constexpr double kJump_dn = 5.0;
    for (std::size_t f = 0; f < stack.frames(); ++f) {
      const double found = stack.frame_means_dn()[f];
      if (std::abs(found - mean) > kJump_dn) {
        throw StepRefused(fmt::format(
            "{}: frame {} of {} s has {:.1f} DN where the others have {:.1f}, expected the same: "
            "keep light out and take the set again",
            kDarkStep, f, stack.exposure_s(), found, mean));
      }
    }
  }
}

/// Offset and current of every pixel by least squares, each stack weighing by its frames.
void fill_maps(Darks& darks, std::span<const PixelStack> stacks) {
  double s0 = 0.0;
  double s1 = 0.0;
  double s2 = 0.0;
  for (const PixelStack& stack : stacks) {
    const auto weight = static_cast<double>(stack.frames());
    s0 += weight;
    s1 += weight * stack.exposure_s();
    s2 += weight * stack.exposure_s() * stack.exposure_s();
  }
  const double determinant = s0 * s2 - s1 * s1;
  darks.covariance_per_noise2 << s2 / determinant, -s1 / determinant, -s1 / determinant,
      s0 / determinant;
  const std::size_t pixels = stacks[0].pixels();
  darks.offset_dn.resize(pixels);
  darks.current_dn_per_s.resize(pixels);
  darks.noise_dn.resize(pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    double y0 = 0.0;
    double y1 = 0.0;
    for (const PixelStack& stack : stacks) {
      const double weighted = static_cast<double>(stack.frames()) * stack.mean_dn(p);
      y0 += weighted;
      y1 += weighted * stack.exposure_s();
    }
    darks.offset_dn[p] = static_cast<float>((s2 * y0 - s1 * y1) / determinant);
    darks.current_dn_per_s[p] = static_cast<float>((s0 * y1 - s1 * y0) / determinant);
    darks.noise_dn[p] = static_cast<float>(std::sqrt(stacks[0].variance_dn2(p)));
  }
}

/// Temporal sd over all stacks, relative to what a pixel of the same dark signal has: the median's
/// noise and the shot noise of what it has more. A blinking pixel is above, a merely hot one not.
std::vector<float> relative_noise(const Darks& darks, std::span<const PixelStack> stacks,
                                  double median_current, double gain_dn_per_e) {
  const std::size_t pixels = stacks[0].pixels();
  std::vector<double> found(pixels, 0.0);
  std::vector<double> expected(pixels, 0.0);
  std::vector<float> variance(pixels);
  constexpr double kRounding_dn2 = 1.0 / 12.0;  // of a sensor that shows no noise at all
  for (const PixelStack& stack : stacks) {
    for (std::size_t p = 0; p < pixels; ++p) {
      variance[p] = static_cast<float>(stack.variance_dn2(p));
    }
    const double usual = std::max(kRounding_dn2, median(variance));
    const double weight = static_cast<double>(stack.frames()) - 1.0;
    for (std::size_t p = 0; p < pixels; ++p) {
      const double excess =
          std::max(0.0, darks.current_dn_per_s[p] - median_current) * stack.exposure_s();
      found[p] += weight * variance[p];
      expected[p] += weight * (usual + gain_dn_per_e * excess);
    }
  }
  std::vector<float> noise(pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    noise[p] = static_cast<float>(std::sqrt(found[p] / expected[p]));
  }
  return noise;
}

void fill_defects(Darks& darks, std::span<const PixelStack> stacks, const DarkOptions& options) {
  const MedianAndSpread current = median_and_spread(darks.current_dn_per_s);
  const std::vector<float> noise =
      relative_noise(darks, stacks, current.median, options.gain_dn_per_e);
  const MedianAndSpread usual = median_and_spread(noise);
  // Of a sensor whose noise rounding hides, most pixels may show the same.
  constexpr double kLeastSpread = 0.05;
  const double noise_limit =
      usual.median + options.mad_sigmas * std::max(usual.sigma, kLeastSpread);
  double hot_limit = current.median + options.mad_sigmas * current.sigma;
  if (options.hot_dn_per_s > 0.0) hot_limit = std::min(hot_limit, options.hot_dn_per_s);
  darks.defects.assign(noise.size(), 0);
  std::size_t bad = 0;
  for (std::size_t p = 0; p < noise.size(); ++p) {
    std::uint8_t& bits = darks.defects[p];
    if (darks.current_dn_per_s[p] > hot_limit) bits |= defect::kHot;
    if (noise[p] > noise_limit) bits |= defect::kBlinking;
    if (bits != 0) ++bad;
  }
  darks.bad_fraction = static_cast<double>(bad) / static_cast<double>(noise.size());
}

struct GoodMeans {
  double mean_dn = 0.0;
  double variance_dn2 = 0.0;
  double pixels = 0.0;
};

GoodMeans good_means(const PixelStack& stack, const std::vector<std::uint8_t>& defects) {
  GoodMeans means;
  for (std::size_t p = 0; p < defects.size(); ++p) {
    if (defects[p] != 0) continue;
    means.mean_dn += stack.mean_dn(p);
    means.variance_dn2 += stack.variance_dn2(p);
    means.pixels += 1.0;
  }
  means.mean_dn /= means.pixels;
  means.variance_dn2 /= means.pixels;
  return means;
}

/// How far the mean of a frame wanders about that of its stack: noise of the pixels and of the
/// black level, which all pixels share.
double frame_scatter(std::span<const PixelStack> stacks) {
  double squares = 0.0;
  double freedom = 0.0;
  for (const PixelStack& stack : stacks) {
    const double mean = mean_of(stack.frame_means_dn());
    for (const double value : stack.frame_means_dn()) squares += (value - mean) * (value - mean);
    freedom += static_cast<double>(stack.frames()) - 1.0;
  }
  return std::sqrt(squares / freedom);
}

void fill_summary(Darks& darks, std::span<const PixelStack> stacks, const DarkOptions& options) {
  const auto rows = static_cast<Eigen::Index>(stacks.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Ones(rows, 2);
  Eigen::VectorXd all(rows);
  Eigen::VectorXd good(rows);
  Eigen::VectorXd mean_sigma(rows);
  Eigen::VectorXd variance(rows);
  Eigen::VectorXd variance_sigma(rows);
  constexpr double kNoiseless_dn = 1e-6;
  const double scatter = std::max(frame_scatter(stacks), kNoiseless_dn);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const PixelStack& stack = stacks[static_cast<std::size_t>(k)];
    const auto frames = static_cast<double>(stack.frames());
    const GoodMeans means = good_means(stack, darks.defects);
    design(k, 1) = stack.exposure_s();
    all[k] = mean_of(stack.frame_means_dn());
    good[k] = means.mean_dn;
    mean_sigma[k] = scatter / std::sqrt(frames);
    variance[k] = means.variance_dn2;
    variance_sigma[k] = std::max(
        means.variance_dn2 * std::sqrt(2.0 / ((frames - 1.0) * means.pixels)), kNoiseless_dn);
  }
  const WeightedFit level = weighted_fit(design, all, mean_sigma);
  const WeightedFit mean = weighted_fit(design, good, mean_sigma);
  const WeightedFit noise = weighted_fit(design, variance, variance_sigma);

  const double rate_sigma = std::sqrt(mean.covariance(1, 1) * mean.widening());
  darks.mean_rate_dn_per_s = {mean.parameters[1], rate_sigma};
  darks.variance_rate_dn2_per_s = {noise.parameters[1],
                                   std::sqrt(noise.covariance(1, 1) * noise.widening())};
  const double v0 = std::max(noise.parameters[0], kNoiseless_dn);
  darks.temporal_noise_dn = {
      std::sqrt(v0), std::sqrt(noise.covariance(0, 0) * noise.widening()) / (2.0 * std::sqrt(v0))};

  const auto pixels = static_cast<double>(darks.offset_dn.size());
  const MedianAndSpread offset = median_and_spread(darks.offset_dn);
  const MedianAndSpread current = median_and_spread(darks.current_dn_per_s);
  darks.black_level_dn = {offset.median,
                          std::hypot(std::sqrt(mean.covariance(0, 0) * mean.widening()),
                                     kMedianSigma * offset.sigma / std::sqrt(pixels))};
  darks.dark_current_dn_per_s = {
      current.median, std::hypot(rate_sigma, kMedianSigma * current.sigma / std::sqrt(pixels))};

  double change = 0.0;
  for (Eigen::Index k = 0; k < rows; ++k) {
    for (const double found : stacks[static_cast<std::size_t>(k)].frame_means_dn()) {
      change = std::max(change, std::abs(found - level.fitted[k]));
    }
  }
  darks.acceptance = {
      {"black level, change between frames (DN)", options.max_black_change_dn, change},
      {"bad pixels (fraction)", options.max_bad_fraction, darks.bad_fraction}};
}

}  // namespace

Darks fit_darks(std::span<const PixelStack> stacks, const DarkOptions& options) {
  check_stacks(stacks, options);
  Darks darks;
  darks.width_px = stacks[0].width_px();
  darks.height_px = stacks[0].height_px();
  fill_maps(darks, stacks);
  const double black = median(darks.offset_dn);
  const double noise = median(darks.noise_dn);
  constexpr double kSafe = 5.0;  // no noise is cut off at 0
  if (black < kSafe * noise) {
    throw StepRefused(
        fmt::format("{}: a black level of {:.1f} DN under a noise of {:.2f} DN, expected {:.0f} "
                    "sigma at least: "
                    "raise the camera's black level",
                    kDarkStep, black, noise, kSafe));
  }
  fill_defects(darks, stacks, options);
  constexpr double kMostBad = 0.5;
  if (darks.bad_fraction > kMostBad) {
    throw StepRefused(fmt::format("{}: {:.0f} % of the pixels are bad, expected less than {:.0f} %",
                                  kDarkStep, 100.0 * darks.bad_fraction, 100.0 * kMostBad));
  }
  fill_summary(darks, stacks, options);
  return darks;
}

std::vector<std::uint8_t> flat_defects(std::span<const double> signal_dn, int width_px,
                                       int height_px, int step) {
  if (width_px < 1 || height_px < 1 || step < 1 ||
      signal_dn.size() !=
          static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px)) {
    throw std::invalid_argument(fmt::format("flat defects: {} pixels, step {}, expected {} x {}",
                                            signal_dn.size(), step, width_px, height_px));
  }
  const double usual = median({signal_dn.begin(), signal_dn.end()});
  constexpr double kLit_dn = 5.0;
  if (!(usual > kLit_dn)) {
    throw StepRefused(
        fmt::format("flat defects: a signal of {:.2f} DN above dark, expected more "
                    "than {:.0f}: the lamp is off or the shutter closed",
                    usual, kLit_dn));
  }
  constexpr int kReach = 2;        // 5 x 5
  constexpr double kUnlit = 0.05;  // of the median: not on the white plane, not judged
  constexpr double kLow = 0.5;
  constexpr double kHigh = 1.5;
  std::vector<std::uint8_t> defects(signal_dn.size(), 0);
  std::array<double, static_cast<std::size_t>((2 * kReach + 1) * (2 * kReach + 1))> around{};
  for (int row = 0; row < height_px; ++row) {
    for (int column = 0; column < width_px; ++column) {
      std::size_t found = 0;
      for (int y = row - kReach * step; y <= row + kReach * step; y += step) {
        for (int x = column - kReach * step; x <= column + kReach * step; x += step) {
          if (x < 0 || y < 0 || x >= width_px || y >= height_px) continue;
          around[found++] =
              signal_dn[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_px) +
                        static_cast<std::size_t>(x)];
        }
      }
      const auto middle = around.begin() + static_cast<std::ptrdiff_t>(found / 2);
      std::nth_element(around.begin(), middle, around.begin() + static_cast<std::ptrdiff_t>(found));
      const std::size_t p = static_cast<std::size_t>(row) * static_cast<std::size_t>(width_px) +
                            static_cast<std::size_t>(column);
      if (*middle < kUnlit * usual) continue;
      // Written so that a signal that is no number is a defect.
      const bool good = signal_dn[p] >= kLow * *middle && signal_dn[p] <= kHigh * *middle;
      if (!good) defects[p] = defect::kCold;
    }
  }
  return defects;
}

}  // namespace gonio::calibration::sensor
