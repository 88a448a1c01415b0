#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "bracket.h"

namespace gonio::acquisition {

/// Looks whether the light of the room stays what it is: compares each lamp-off frame with the one
/// before. A point's lamp-off frame stands for the room's light in its lit frames, which it does
/// not when that light changed between them.
///
/// Threads  One.
class AmbientWatch {
 public:
  /// `sensor` and `options` must outlive it. `warn` is told when it gives up and when it looks
  /// again.
  AmbientWatch(const instrument::SensorModel& sensor, const SessionOptions& options,
               std::function<void(std::string)> warn)
      : sensor_(sensor), options_(options), warn_(std::move(warn)) {}

  /// New dark frames follow.
  void begin_darks();
  void add_dark(const devices::Frame& frame);

  /// What changed since the lamp-off frame before, by more than noise and dark current do and by so
  /// much that it matters to the wanted precision where the target is dimmest; empty: nothing. The
  /// level found is what the next one is compared with. Where every other frame says so the light
  /// differs by the pose or never rests, and measuring again would not help: there is a warning,
  /// and nothing is said of changes until the light was steady for a while.
  ///
  /// `target`   What the frame shows, compared with the last frame of the same if there is one: a
  ///            lit room looks another in a white and in a dark sample.
  /// `regions`  Of the target, not empty.
  /// `dimmest_dn_per_s`  The least signal of a region of it under the lamp, above black; 0: none
  ///                     that a sample could come of.
  std::string changed(const devices::Frame& lamp_off, devices::Target target,
                      const Regions& regions, double dimmest_dn_per_s);

 private:
  /// Mean over the target, above the darks.
  struct Level {
    double dn_per_s = 0.0;
    double u_dn_per_s = 0.0;  ///< noise, k = 1
  };
  Level level_of(const devices::Frame& lamp_off, const Regions& regions) const;
  std::string change_since(const Level& before, const Level& now, double dimmest_dn_per_s) const;

  const instrument::SensorModel& sensor_;
  const SessionOptions& options_;
  std::vector<std::uint32_t> dark_sums_dn_;  ///< per pixel
  int darks_ = 0;
  std::map<devices::Target, Level> last_;
  std::function<void(std::string)> warn_;
  std::deque<bool> recent_;  ///< whether the last comparisons found a change
  bool given_up_ = false;    ///< it changes so often that changes tell nothing
};

}  // namespace gonio::acquisition
