#include "bracket_rules.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "gonio/devices/clock.h"
#include "saturation.h"

namespace gonio::acquisition {
namespace {

/// Below this the black level's own uncertainty (0.05 DN) is no longer small against 1 %.
constexpr double kLeastSignal_dn = 20.0;
constexpr double kSafeFraction = 0.95;
constexpr double kLongestStep = 64.0;
/// From one exposure to a longer one: less would cost a readout for little.
constexpr double kLeastStep = 1.5;
/// A spot with less than three sigmas of signal is a bound, not a value.
constexpr double kDarkRelativeSigma = 1.0 / 3.0;

/// Of the wanted signal: a last step is aimed at it and not beyond.
constexpr double kShortTolerance = 0.02;

/// Signal above black at which a region's mean has the wanted relative sigma.
double signal_dn(const instrument::SensorModel& sensor, double relative_sigma, double pixels) {
  const double k = sensor.gain_dn_per_e;
  const double read_variance = k * k * sensor.read_noise_e * sensor.read_noise_e + 1.0 / 12.0;
  const double a = relative_sigma * relative_sigma * pixels;
  // a x^2 = read_variance + k x
  const double x = (k + std::sqrt(k * k + 4.0 * a * read_variance)) / (2.0 * a);
  return x;
}

/// Of a spot: a region of the target is larger than what becomes a sub-sample.
double spot_pixels(const SessionOptions& options, double region_pixels) {
  const double fraction =
      std::min(1.0, std::pow(3.0 * options.spot_half_width_mm / options.sample_half_width_mm, 2));
  return std::max(1.0, fraction * region_pixels);
}

std::chrono::nanoseconds scaled(std::chrono::nanoseconds exposure, double factor) {
  return std::chrono::nanoseconds(std::llround(static_cast<double>(exposure.count()) * factor));
}

}  // namespace

double wanted_signal_dn(const instrument::SensorModel& sensor, const SessionOptions& options,
                        double region_pixels) {
  return std::max(kLeastSignal_dn,
                  signal_dn(sensor, options.relative_sigma, spot_pixels(options, region_pixels)));
}

BracketResult bracket_exposures(
    const instrument::SensorModel& sensor, const SessionOptions& options,
    const devices::CameraInfo& camera, std::chrono::nanoseconds first_exposure,
    const std::function<std::vector<RegionReading>(std::chrono::nanoseconds)>& expose) {
  const auto longest_allowed = std::min(options.max_exposure, camera.max_exposure);
  const double saturation_dn = saturation_level_dn(sensor, camera.saturation_level_dn);
  int taken = 0;
  const auto expose_counted = [&](std::chrono::nanoseconds exposure) {
    ++taken;
    return expose(exposure);
  };
  const auto exposed_s = [&](std::chrono::nanoseconds exposure) {
    return devices::to_seconds(exposure) + sensor.shutter_offset_s;
  };

  BracketResult result;
  auto shortest = std::clamp(first_exposure, camera.min_exposure, longest_allowed);
  auto longest = shortest;
  std::vector<RegionReading> readings = expose_counted(shortest);
  result.regions = static_cast<int>(readings.size());
  std::vector<RegionReading> longest_readings = readings;

  const auto saturated = [&] {
    return std::count_if(readings.begin(), readings.end(), [&](const RegionReading& reading) {
      return reading.maximum_dn >= saturation_dn;
    });
  };
  while (saturated() > 0 && shortest > camera.min_exposure && taken < options.max_exposures) {
    shortest = std::max(camera.min_exposure, scaled(shortest, 1.0 / options.bracket_ratio));
    readings = expose_counted(shortest);
  }
  result.saturated_regions = static_cast<int>(saturated());

  // Each region's rate from the longest exposure that shows it unsaturated so far. A region that
  // is full even in the shortest has none: no exposure can help it, and it is not dark.
  std::vector<std::optional<double>> rates_dn_per_s(readings.size());
  const auto update_rates = [&](const std::vector<RegionReading>& from,
                                std::chrono::nanoseconds exposure) {
    for (std::size_t i = 0; i < from.size(); ++i) {
      if (from[i].maximum_dn < saturation_dn) {
        rates_dn_per_s[i] = from[i].mean_dn / exposed_s(exposure);
      }
    }
  };
  update_rates(readings, shortest);
  if (longest != shortest) update_rates(longest_readings, longest);

  const auto wanted_dn = [&](const RegionReading& reading) {
    return wanted_signal_dn(sensor, options, reading.pixels);
  };
  const auto needed_factor = [&] {
    double factor = 1.0;
    for (std::size_t i = 0; i < readings.size(); ++i) {
      if (!rates_dn_per_s[i]) continue;
      const double wanted = wanted_dn(readings[i]);
      const double found = std::max(*rates_dn_per_s[i] * exposed_s(longest), wanted / kLongestStep);
      factor = std::max(factor, wanted / found);
    }
    return factor;
  };
  while (longest < longest_allowed && taken < options.max_exposures) {
    const double factor = needed_factor();
    if (factor <= 1.0) break;
    longest = std::min(longest_allowed, scaled(longest, std::max(kLeastStep, 1.2 * factor)));
    longest_readings = expose_counted(longest);
    update_rates(longest_readings, longest);
  }
  std::optional<double> dimmest_dn_per_s;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (!rates_dn_per_s[i]) continue;
    result.brightest_dn_per_s = std::max(result.brightest_dn_per_s, *rates_dn_per_s[i]);
    if (*rates_dn_per_s[i] * exposed_s(longest) <
        signal_dn(sensor, kDarkRelativeSigma, spot_pixels(options, readings[i].pixels))) {
      ++result.dark_regions;
    } else {
      dimmest_dn_per_s =
          std::min(dimmest_dn_per_s.value_or(*rates_dn_per_s[i]), *rates_dn_per_s[i]);
    }
    const double found = *rates_dn_per_s[i] * exposed_s(longest);
    if (found < (1.0 - kShortTolerance) * wanted_dn(readings[i])) ++result.short_regions;
  }

  result.dimmest_dn_per_s = std::max(0.0, dimmest_dn_per_s.value_or(0.0));
  result.longest = longest;
  const auto brightest = std::max_element(
      readings.begin(), readings.end(),
      [](const RegionReading& a, const RegionReading& b) { return a.maximum_dn < b.maximum_dn; });
  const double above_black = brightest->maximum_dn - sensor.black_level_dn;
  const bool usable =
      above_black > kLeastSignal_dn && brightest->maximum_dn < kSafeFraction * saturation_dn;
  const double aim = usable ? kAimedFraction * saturation_dn / above_black : 1.0;
  result.start = std::clamp(scaled(shortest, aim), camera.min_exposure, longest_allowed);
  return result;
}

}  // namespace gonio::acquisition
