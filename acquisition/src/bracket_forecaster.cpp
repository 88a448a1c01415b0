#include "bracket_forecaster.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gonio/devices/clock.h"

namespace gonio::acquisition {
namespace {

/// Noise decides as brackets do. The brightest of the hundreds of pixels of a region lies so many
/// of their sigmas above the brightest place, the dimmest of nine regions about as bright reads so
/// many of its own below what is true, each with its spread (mean and standard deviation of the
/// largest of 900 and of 9 normal numbers).
constexpr double kBrightestPixel = 3.2;
constexpr double kBrightestPixelSpread = 0.35;
constexpr double kDimmestRegion = 1.5;
constexpr double kDimmestRegionSpread = 0.6;

}  // namespace

Foreseen BracketForecaster::foresee(const ChannelRegions& regions,
                                    std::chrono::nanoseconds first_exposure, double brightness,
                                    double noise) const {
  Foreseen foreseen;
  ForecastBracket& bracket = foreseen.bracket;
  bracket.shortest_s = std::numeric_limits<double>::infinity();
  const auto expose = [&](std::chrono::nanoseconds exposure) {
    const double exposure_s = devices::to_seconds(exposure);
    bracket.shortest_s = std::min(bracket.shortest_s, exposure_s);
    bracket.longest_s = std::max(bracket.longest_s, exposure_s);
    bracket.exposed_s += exposure_s;
    ++bracket.frames;
    std::vector<RegionReading> readings;
    readings.reserve(regions.size());
    for (const ExpectedRegion& region : regions) {
      readings.push_back(reading(region, exposure_s + sensor_.shutter_offset_s, brightness, noise));
    }
    return readings;
  };
  foreseen.found = bracket_exposures(sensor_, options_, camera_, first_exposure, expose);
  return foreseen;
}

RegionReading BracketForecaster::reading(const ExpectedRegion& region, double open_s,
                                         double brightness, double noise) const {
  const double k = sensor_.gain_dn_per_e;
  const double dark_dn = k * sensor_.dark_current_e_per_s * open_s;
  RegionReading reading;
  reading.pixels = region.pixels;
  const double mean_dn = region.mean_dn_per_s * brightness * open_s + dark_dn;
  const double brightest_dn = region.maximum_dn_per_s * brightness * open_s + dark_dn;
  const double read_variance = k * k * sensor_.read_noise_e * sensor_.read_noise_e;
  reading.mean_dn = mean_dn - (kDimmestRegion + noise * kDimmestRegionSpread) *
                                  std::sqrt((read_variance + k * mean_dn) / region.pixels);
  const double sigma_dn =
      std::sqrt(read_variance + k * brightest_dn + std::pow(sensor_.prnu * brightest_dn, 2));
  const double full_dn = camera_.saturation_level_dn > 0
                             ? static_cast<double>(camera_.saturation_level_dn)
                             : sensor_.saturation_dn;
  // Far above saturation the response curve, a polynomial, means nothing.
  const double above = kBrightestPixel + noise * kBrightestPixelSpread;
  const double linear_dn =
      std::min(brightest_dn + above * sigma_dn, full_dn - sensor_.black_level_dn);
  reading.maximum_dn = sensor_.black_level_dn + sensor_.response.measured_dn(linear_dn);
  if (linear_dn >= full_dn - sensor_.black_level_dn) reading.maximum_dn = full_dn;
  return reading;
}

}  // namespace gonio::acquisition
