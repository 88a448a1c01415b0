#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "gonio/acquisition/part_bridge.h"

namespace gonio::acquisition {

/// How a light went, by one thing that was measured again and again, white or sentinel: linear
/// between its readings. Beyond them it goes on with their median slope, so that a drift drifts on
/// and a step does not; with the less steep of the two in the middle.
class LightCurve {
 public:
  struct Reading {
    double time_s = 0.0;  ///< session clock
    brdf::Rgb level;      ///< above 0, in one unit for all readings
    brdf::Rgb variance;   ///< of what it shares with no other; relative, k = 1, squared
  };

  /// In time, one or more; what is not later than the one before is left out.
  explicit LightCurve(const std::vector<Reading>& readings);

  /// Whether a time was measured beside another, so that a drift would be seen.
  bool shows_drift() const { return readings_.size() > 1; }
  const std::vector<Reading>& readings() const { return readings_; }

  brdf::Rgb level(double time_s) const;
  /// The level with what it is uncertain by: noise, and that a light need not go as evenly as that.
  Reading at(double time_s) const;
  /// From one time to another; noise that is in both levels alike cancels.
  LevelChange change(double from_s, double to_s) const;

 private:
  /// Of a segment, from i to i + 1.
  brdf::Rgb slope(std::size_t i) const;
  /// By which the readings are summed to the level at a time.
  std::vector<double> weights(double time_s, int colour) const;
  /// Relative variance of the level at a time, beside noise: the light may have stepped anywhere in
  /// a segment that is unlike the others; beyond the readings the drift may have stopped or
  /// doubled, or have been that of the segment next to it.
  brdf::Rgb uneven(double time_s) const;
  bool is_beyond(double time_s) const;
  /// The segment a time within the readings lies in.
  std::size_t segment(double time_s) const;

  std::vector<Reading> readings_;
  std::array<std::size_t, 3> usual_{};  ///< segment with the median slope, by colour
};

}  // namespace gonio::acquisition
