#pragma once

#include <chrono>

#include "gonio/devices/clock.h"

namespace gonio::devices {

/// The host's monotonic clock as a session's time: 0 when constructed, then on by itself.
///
/// Scale    With 50, fifty seconds of session pass in one of the host's: for emulated rigs that run
///          faster than real ones. A rig of metal has 1.
/// Threads  All members from any thread.
class SteadyClock final : public Clock {
 public:
  /// Throws std::invalid_argument unless `time_scale` is positive and finite.
  explicit SteadyClock(double time_scale = 1.0);

  Duration now() const override;
  void wait_until(Duration time) override;

  double time_scale() const { return time_scale_; }
  /// How long the host takes for `duration` of session time.
  std::chrono::nanoseconds on_host(Duration duration) const;

 private:
  double time_scale_;
  std::chrono::steady_clock::time_point start_;
};

}  // namespace gonio::devices
