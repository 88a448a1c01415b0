#pragma once

#include <algorithm>
#include <chrono>

namespace gonio::devices {

/// Time as the session sees it. Injected, so a simulated world runs on virtual time and host time
/// never enters a result.
///
/// Threads  now() from any thread.
class Clock {
 public:
  using Duration = std::chrono::nanoseconds;

  virtual ~Clock() = default;
  Clock(const Clock&) = delete;
  Clock& operator=(const Clock&) = delete;

  /// Time since the start of the session's world. Never goes back.
  virtual Duration now() const = 0;

  /// Waits until `time`; returns at once when it has passed. On a virtual clock this advances it.
  virtual void wait_until(Duration time) = 0;

 protected:
  Clock() = default;
};

/// A time or a duration in seconds.
inline double to_seconds(Clock::Duration time) {
  return std::chrono::duration<double>(time).count();
}

/// When `timeout` from now on is over. One below 0 counts as 0, one of more than a year as a year.
inline Clock::Duration deadline_after(const Clock& clock, std::chrono::milliseconds timeout) {
  constexpr auto kLongest = std::chrono::milliseconds(std::chrono::hours(24 * 365));
  return clock.now() + std::clamp(timeout, std::chrono::milliseconds(0), kLongest);
}

}  // namespace gonio::devices
