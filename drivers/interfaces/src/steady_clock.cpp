#include "gonio/devices/steady_clock.h"

#include <cmath>
#include <stdexcept>
#include <thread>

namespace gonio::devices {

SteadyClock::SteadyClock(double time_scale)
    : time_scale_(time_scale), start_(std::chrono::steady_clock::now()) {
  if (!(time_scale > 0.0 && std::isfinite(time_scale))) {
    throw std::invalid_argument("time_scale: must be positive and finite");
  }
}

Clock::Duration SteadyClock::now() const {
  const auto passed = std::chrono::steady_clock::now() - start_;
  return std::chrono::duration_cast<Duration>(passed * time_scale_);
}

void SteadyClock::wait_until(Duration time) {
  for (Duration left = time - now(); left > Duration(0); left = time - now()) {
    std::this_thread::sleep_for(on_host(left));
  }
}

std::chrono::nanoseconds SteadyClock::on_host(Duration duration) const {
  // Rounded up, so that a wait never ends a moment too early and is then repeated.
  return std::chrono::nanoseconds(
      static_cast<std::int64_t>(std::ceil(static_cast<double>(duration.count()) / time_scale_)));
}

}  // namespace gonio::devices
