#pragma once

#include <chrono>
#include <functional>
#include <vector>

#include "gonio/acquisition/session.h"

namespace gonio::acquisition {

/// One region of the target in one exposure.
struct RegionReading {
  double mean_dn = 0.0;     ///< above black, of a straight sensor
  double maximum_dn = 0.0;  ///< as read
  double pixels = 0.0;      ///< that count; not 0
};

/// What a bracket found out, for the next one and for the outcome of its point.
struct BracketResult {
  std::chrono::nanoseconds start{0};  ///< a good first exposure at the same light level
  std::chrono::nanoseconds longest{0};
  int saturated_regions = 0;  ///< even at the shortest exposure
  int dark_regions = 0;       ///< not saturated, but below three sigmas even at the longest
  int short_regions = 0;      ///< not saturated, but short of the wanted precision at the longest
  int regions = 0;
  double brightest_dn_per_s = 0.0;  ///< mean of the brightest region that is not saturated
  double dimmest_dn_per_s = 0.0;    ///< the same of the dimmest; 0: none
  double lowest_monitor = 0.0;      ///< of the readings beside its frames; 0 without a monitor
  double highest_monitor = 0.0;
};

/// Of saturation: where the brightest pixel of a first exposure is aimed.
inline constexpr double kAimedFraction = 0.6;

/// Signal above black, DN, that the mean of a spot in a region of so many pixels needs for the
/// wanted relative sigma.
double wanted_signal_dn(const instrument::SensorModel& sensor, const SessionOptions& options,
                        double region_pixels);

/// Decides which exposures a bracket takes: shorter ones until the brightest region is unsaturated,
/// longer ones until the dimmest has the wanted precision. A region that stays saturated in the
/// shortest asks for no longer one. The same rules serve a session, whose exposures are frames, and
/// its forecast, whose exposures are arithmetic.
///
/// `expose`  Takes one and returns the readings of all regions, in the same order every time.
BracketResult bracket_exposures(
    const instrument::SensorModel& sensor, const SessionOptions& options,
    const devices::CameraInfo& camera, std::chrono::nanoseconds first_exposure,
    const std::function<std::vector<RegionReading>(std::chrono::nanoseconds)>& expose);

}  // namespace gonio::acquisition
