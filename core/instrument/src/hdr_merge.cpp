#include "gonio/instrument/hdr_merge.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "gonio/parallel/parallel.h"

namespace gonio::instrument {
namespace {

constexpr double kQuantisationVariance = 1.0 / 12.0;
constexpr double kSafeFraction = 0.95;
constexpr double kSafeSigmas = 4.0;
constexpr int kBloomingRadius_px = 2;
constexpr int kWeightIterations = 3;

/// Marks pixels at saturation and their neighbours within the blooming radius. A bad pixel has
/// none: it may be full of no light.
std::vector<std::uint8_t> bloomed(std::span<const std::uint16_t> pixels_dn, int width_px,
                                  double saturation_dn, const std::vector<std::uint8_t>& bad) {
  const auto width = static_cast<std::ptrdiff_t>(width_px);
  const auto height = static_cast<std::ptrdiff_t>(pixels_dn.size()) / width;
  std::vector<std::uint8_t> marked(pixels_dn.size(), 0);
  for (std::ptrdiff_t row = 0; row < height; ++row) {
    for (std::ptrdiff_t column = 0; column < width; ++column) {
      const auto pixel = static_cast<std::size_t>(row * width + column);
      if (pixels_dn[pixel] < saturation_dn || bad[pixel] != 0) continue;
      for (auto r = std::max<std::ptrdiff_t>(0, row - kBloomingRadius_px);
           r <= std::min(height - 1, row + kBloomingRadius_px); ++r) {
        for (auto c = std::max<std::ptrdiff_t>(0, column - kBloomingRadius_px);
             c <= std::min(width - 1, column + kBloomingRadius_px); ++c) {
          marked[static_cast<std::size_t>(r * width + c)] = 1;
        }
      }
    }
  }
  return marked;
}

struct Reading {
  double rate_dn_per_s;  ///< background removed
  double exposure_s;
};

/// Variance of a rate reading when the true rate is `signal`.
double rate_variance(const SensorModel& sensor, double signal, double background_rate, double t) {
  const double k = sensor.gain_dn_per_e;
  const double read = k * sensor.read_noise_e;
  const double shot = k * std::max(0.0, signal + background_rate) * t;
  return (read * read + kQuantisationVariance + shot) / (t * t);
}

}  // namespace

MergedSignal merge_bracket(const SensorModel& sensor, std::span<const Exposure> bracket,
                           int width_px, const Background& background) {
  if (bracket.empty()) throw std::invalid_argument("merge_bracket: no exposure");
  const std::size_t pixel_count = bracket.front().pixels_dn.size();
  if (width_px <= 0 || pixel_count == 0 || pixel_count % static_cast<std::size_t>(width_px) != 0) {
    throw std::invalid_argument("merge_bracket: pixels do not fill whole rows");
  }
  for (const Exposure& exposure : bracket) {
    if (exposure.pixels_dn.size() != pixel_count) {
      throw std::invalid_argument("merge_bracket: frames of different size");
    }
    if (!(exposure.exposure_s + sensor.shutter_offset_s > 0.0)) {
      throw std::invalid_argument("merge_bracket: an exposure time is not positive");
    }
  }
  for (const auto& map : {background.offset_dn, background.rate_dn_per_s}) {
    if (!map.empty() && map.size() != pixel_count) {
      throw std::invalid_argument("merge_bracket: background of another size");
    }
  }

  std::vector<std::size_t> order(bracket.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return bracket[a].exposure_s < bracket[b].exposure_s;
  });
  const std::vector<std::uint8_t> bad = bad_pixel_mask(
      sensor, width_px, static_cast<int>(pixel_count / static_cast<std::size_t>(width_px)));
  std::vector<std::vector<std::uint8_t>> full;
  for (const std::size_t i : order) {
    full.push_back(bloomed(bracket[i].pixels_dn, width_px, sensor.saturation_dn, bad));
  }

  MergedSignal merged{std::vector<double>(pixel_count), std::vector<double>(pixel_count),
                      std::vector<PixelState>(pixel_count)};
  const double safe_dn = kSafeFraction * sensor.saturation_dn;
  const double default_rate = sensor.gain_dn_per_e * sensor.dark_current_e_per_s;

  const auto merge_pixel = [&](std::size_t p, std::vector<Reading>& readings) {
    if (bad[p] != 0) {
      merged.state[p] = PixelState::defective;
      return;
    }
    const double offset =
        background.offset_dn.empty() ? sensor.black_level_dn : background.offset_dn[p];
    const double rate =
        background.rate_dn_per_s.empty() ? default_rate : background.rate_dn_per_s[p];
    const double safe_signal_dn = sensor.response.linear_dn(safe_dn - offset);
    readings.clear();
    bool saturated = false;
    double estimate = 0.0;
    double variance = 0.0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      const Exposure& exposure = bracket[order[i]];
      const double t = exposure.exposure_s + sensor.shutter_offset_s;
      if (full[i][p] != 0) {
        saturated = true;
        break;  // longer exposures are full too
      }
      if (!readings.empty()) {
        const double predicted_dn = (estimate + rate) * t;
        const double predicted_sd =
            t * std::sqrt(variance + rate_variance(sensor, estimate, rate, t));
        if (predicted_dn + kSafeSigmas * predicted_sd > safe_signal_dn) break;
      }
      if (exposure.pixels_dn[p] == 0) continue;  // clipped at black: below what a DN can tell
      const double signal_dn = sensor.response.linear_dn(exposure.pixels_dn[p] - offset);
      readings.push_back({signal_dn / t - rate, t});
      for (int iteration = 0; iteration < kWeightIterations; ++iteration) {
        double sum = 0.0;
        double weights = 0.0;
        for (const Reading& reading : readings) {
          const double weight = 1.0 / rate_variance(sensor, estimate, rate, reading.exposure_s);
          sum += weight * reading.rate_dn_per_s;
          weights += weight;
        }
        estimate = sum / weights;
        variance = 1.0 / weights;
      }
    }
    if (readings.empty()) {
      merged.state[p] = saturated ? PixelState::saturated : PixelState::black_clipped;
      return;
    }
    merged.dn_per_s[p] = estimate;
    merged.variance[p] = variance;
    merged.state[p] = PixelState::measured;
  };

  constexpr std::size_t kBlock = 4096;
  parallel::for_each_block(0, pixel_count, kBlock, [&](std::size_t begin, std::size_t end) {
    std::vector<Reading> readings;
    for (std::size_t p = begin; p < end; ++p) merge_pixel(p, readings);
  });
  return merged;
}

}  // namespace gonio::instrument
