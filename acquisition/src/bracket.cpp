#include "bracket.h"

#include <algorithm>
#include <cmath>

#include "gonio/devices/clock.h"
#include "gonio/instrument/measurement_equation.h"
#include "saturation.h"
#include "standing_capture.h"

namespace gonio::acquisition {
namespace {

/// Below this the black level's own uncertainty (0.05 DN) is no longer small against 1 %.
constexpr double kLeastSignal_dn = 20.0;
/// Where the brightest region of the next exposure is aimed.
constexpr double kAimedFraction = 0.6;
constexpr double kSafeFraction = 0.95;
constexpr double kLongestStep = 64.0;
/// A spot with less than three sigmas of signal is a bound, not a value.
constexpr double kDarkRelativeSigma = 1.0 / 3.0;

struct RegionReading {
  double mean_dn = 0.0;     ///< above black, of a straight sensor
  double maximum_dn = 0.0;  ///< as read
  double pixels = 0.0;
};

std::vector<RegionReading> read_regions(const devices::Frame& frame, const Regions& regions,
                                        const instrument::ResponseCurve& response) {
  std::vector<RegionReading> readings;
  for (const auto& region : regions) {
    RegionReading reading;
    double sum = 0.0;
    for (const std::size_t pixel : region) {
      const double dn = frame.pixels_dn[pixel];
      sum += response.linear_dn(dn - frame.black_level_dn);
      reading.maximum_dn = std::max(reading.maximum_dn, dn);
    }
    reading.pixels = static_cast<double>(region.size());
    reading.mean_dn = sum / reading.pixels;
    readings.push_back(reading);
  }
  return readings;
}

/// Signal above black at which a region's mean has the wanted relative sigma.
double signal_dn(const instrument::SensorModel& sensor, double relative_sigma, double pixels) {
  const double k = sensor.gain_dn_per_e;
  const double read_variance = k * k * sensor.read_noise_e * sensor.read_noise_e + 1.0 / 12.0;
  const double a = relative_sigma * relative_sigma * pixels;
  // a x^2 = read_variance + k x
  const double x = (k + std::sqrt(k * k + 4.0 * a * read_variance)) / (2.0 * a);
  return x;
}

std::chrono::nanoseconds scaled(std::chrono::nanoseconds exposure, double factor) {
  return std::chrono::nanoseconds(std::llround(static_cast<double>(exposure.count()) * factor));
}

}  // namespace

Regions regions_of(const instrument::Instrument& instrument, const rig::RigPose& pose,
                   const Eigen::Vector2d& centre_mm, double half_width_mm, int grid) {
  Regions regions(static_cast<std::size_t>(grid * grid));
  const int width = instrument.camera.width_px;
  const std::vector<std::uint8_t> bad =
      instrument::bad_pixel_mask(instrument.sensor, width, instrument.camera.height_px);
  for (int row = 0; row < instrument.camera.height_px; ++row) {
    for (int column = 0; column < width; ++column) {
      const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(column);
      if (bad[pixel] != 0) continue;
      const auto geometry = instrument::pixel_geometry(instrument, pose, column, row);
      if (!geometry) continue;
      const Eigen::Vector2d place =
          (geometry->point_in_sample_mm.head<2>() - centre_mm) / half_width_mm;
      if (place.cwiseAbs().maxCoeff() >= 1.0) continue;
      const auto index = [&](double coordinate) {
        // Rounding may carry a coordinate just below 1 over the last border.
        return std::min(grid - 1, static_cast<int>((coordinate + 1.0) / 2.0 * grid));
      };
      regions[static_cast<std::size_t>(index(place.y()) * grid + index(place.x()))].push_back(
          pixel);
    }
  }
  std::erase_if(regions, [](const auto& region) { return region.empty(); });
  return regions;
}

BracketResult take_bracket(GuardedDevices& devices, const instrument::Instrument& instrument,
                           const SessionOptions& options, const Regions& regions,
                           std::chrono::nanoseconds first_exposure, const FrameRecord& record,
                           SessionWriter& archive) {
  const devices::CameraInfo info = devices.devices().camera->info();
  const auto longest_allowed = std::min(options.max_exposure, info.max_exposure);
  const double saturation_dn = saturation_level_dn(instrument.sensor, info.saturation_level_dn);
  int taken = 0;

  const auto expose = [&](std::chrono::nanoseconds exposure) {
    FrameRecord own = record;
    const devices::Frame frame = capture_standing(devices, exposure, own);
    own.monitor = devices.read_monitor();
    archive.append(std::move(own), frame);
    ++taken;
    return read_regions(frame, regions, instrument.sensor.response);
  };

  const auto exposed_s = [&](std::chrono::nanoseconds exposure) {
    return devices::to_seconds(exposure) + instrument.sensor.shutter_offset_s;
  };

  BracketResult result;
  result.regions = static_cast<int>(regions.size());
  auto shortest = std::clamp(first_exposure, info.min_exposure, longest_allowed);
  auto longest = shortest;
  std::vector<RegionReading> readings = expose(shortest);
  std::vector<RegionReading> longest_readings = readings;

  const auto saturated = [&] {
    return std::count_if(readings.begin(), readings.end(), [&](const RegionReading& reading) {
      return reading.maximum_dn >= saturation_dn;
    });
  };
  while (saturated() > 0 && shortest > info.min_exposure && taken < options.max_exposures) {
    shortest = std::max(info.min_exposure, scaled(shortest, 1.0 / options.bracket_ratio));
    readings = expose(shortest);
  }
  result.saturated_regions = static_cast<int>(saturated());

  // Each region's rate from the longest exposure that shows it unsaturated so far. A region that
  // is full even in the shortest has none: no exposure can help it, and it is not dark.
  std::vector<std::optional<double>> rates_dn_per_s(regions.size());
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

  // A region of the target is larger than the spot that becomes a sub-sample.
  const double spot_fraction =
      std::min(1.0, std::pow(3.0 * options.spot_half_width_mm / options.sample_half_width_mm, 2));
  const auto spot_pixels = [&](const RegionReading& reading) {
    return std::max(1.0, spot_fraction * reading.pixels);
  };
  const auto wanted_dn = [&](const RegionReading& reading) {
    return std::max(kLeastSignal_dn,
                    signal_dn(instrument.sensor, options.relative_sigma, spot_pixels(reading)));
  };
  const auto needed_factor = [&] {
    double factor = 1.0;
    for (std::size_t i = 0; i < regions.size(); ++i) {
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
    longest =
        std::min(longest_allowed, scaled(longest, std::max(options.bracket_ratio, 1.2 * factor)));
    longest_readings = expose(longest);
    update_rates(longest_readings, longest);
  }
  for (std::size_t i = 0; i < regions.size(); ++i) {
    if (!rates_dn_per_s[i]) continue;
    if (*rates_dn_per_s[i] * exposed_s(longest) <
        signal_dn(instrument.sensor, kDarkRelativeSigma, spot_pixels(readings[i]))) {
      ++result.dark_regions;
    }
  }

  result.longest = longest;
  const auto brightest = std::max_element(
      readings.begin(), readings.end(),
      [](const RegionReading& a, const RegionReading& b) { return a.maximum_dn < b.maximum_dn; });
  const double above_black = brightest->maximum_dn - instrument.sensor.black_level_dn;
  const bool usable =
      above_black > kLeastSignal_dn && brightest->maximum_dn < kSafeFraction * saturation_dn;
  const double aim = usable ? kAimedFraction * saturation_dn / above_black : 1.0;
  result.start = std::clamp(scaled(shortest, aim), info.min_exposure, longest_allowed);
  return result;
}

}  // namespace gonio::acquisition
