#pragma once

#include <atomic>
#include <functional>
#include <optional>

#include "gonio/devices/clock.h"
#include "gonio/devices/steady_clock.h"

namespace gonio::sim {

/// The time of one simulated world. It stands still until somebody waits: an axis for its move, a
/// camera for its exposure, a session for a moment. Host time never enters it, so a session of an
/// hour runs in seconds and gives the same times on every machine.
///
/// Pace     With a time scale, a wait also takes real time: wall = virtual / scale. The times read
///          are the same; only a stop() from another thread falls where the host puts it.
/// Running  On request it runs on by itself at that scale, whether anybody waits or not: the world
///          behind an emulated wire, whose masters are other processes.
/// Threads  All members from any thread.
class VirtualClock final : public devices::Clock {
 public:
  enum class Between { stands_still, runs };  ///< what it does while nobody waits

  /// Throws std::invalid_argument unless `time_scale`, when given, is positive and finite, and when
  /// a clock that runs has none. It begins at `start`.
  explicit VirtualClock(std::optional<double> time_scale = std::nullopt,
                        Between between = Between::stands_still, Duration start = Duration(0));

  Duration now() const override;
  void wait_until(Duration time) override;

  /// As wait_until(), but gives up as soon as `interrupted` says so; it is asked at least once.
  /// Returns false when it gave up; the clock then stands where the interruption found it.
  bool wait_until(Duration time, const std::function<bool()>& interrupted);

 private:
  void raise_to(Duration time);

  std::optional<double> time_scale_;
  std::optional<devices::SteadyClock> running_;
  Duration start_;  ///< of a clock that runs
  std::atomic<Duration::rep> now_ns_;
};

}  // namespace gonio::sim
