#pragma once

#include <chrono>
#include <vector>

#include "bracket_rules.h"
#include "expected_regions.h"
#include "gonio/acquisition/forecast.h"

namespace gonio::acquisition {

/// A bracket as it would be, with what the rules found out.
struct Foreseen {
  ForecastBracket bracket;
  BracketResult found;
};

using ChannelRegions = std::vector<ExpectedRegion>;

using ChannelRegions = std::vector<ExpectedRegion>;

/// Takes brackets in thought: bracket_exposures() on what regions are expected to read. All that is
/// passed by reference must outlive it.
class BracketForecaster {
 public:
  BracketForecaster(const instrument::SensorModel& sensor, const SessionOptions& options,
                    const devices::CameraInfo& camera)
      : sensor_(sensor), options_(options), camera_(camera) {}

  /// With everything `brightness` times as bright as expected, and noise larger than usual by
  /// `noise` of its spreads.
  Foreseen foresee(const ChannelRegions& regions, std::chrono::nanoseconds first_exposure,
                   double brightness, double noise = 0.0) const;

 private:
  RegionReading reading(const ExpectedRegion& region, double open_s, double brightness,
                        double noise) const;

  const instrument::SensorModel& sensor_;
  const SessionOptions& options_;
  const devices::CameraInfo& camera_;
};

}  // namespace gonio::acquisition
