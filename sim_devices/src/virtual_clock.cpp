#include "gonio/sim/virtual_clock.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <thread>

namespace gonio::sim {
namespace {

// How late a paced wait may notice a stop().
constexpr std::chrono::milliseconds kPaceSlice{5};

}  // namespace

VirtualClock::VirtualClock(std::optional<double> time_scale, Between between, Duration start)
    : time_scale_(time_scale), start_(start), now_ns_(start.count()) {
  if (time_scale_ && !(*time_scale_ > 0.0 && std::isfinite(*time_scale_))) {
    throw std::invalid_argument("time_scale: must be positive and finite");
  }
  if (between == Between::runs) {
    if (!time_scale_) throw std::invalid_argument("time_scale: a clock that runs needs one");
    running_.emplace(*time_scale_);
  }
}

devices::Clock::Duration VirtualClock::now() const {
  return running_ ? start_ + running_->now() : Duration(now_ns_.load());
}

void VirtualClock::wait_until(Duration time) {
  wait_until(time, [] { return false; });
}

bool VirtualClock::wait_until(Duration time, const std::function<bool()>& interrupted) {
  if (!time_scale_) {
    if (interrupted()) return false;
    raise_to(time);
    return true;
  }

  if (running_) {
    while (true) {
      if (interrupted()) return false;
      const Duration left = time - now();
      if (left <= Duration(0)) return true;
      std::this_thread::sleep_for(
          std::min<std::chrono::nanoseconds>(running_->on_host(left), kPaceSlice));
    }
  }

  using Wall = std::chrono::steady_clock;
  const Wall::time_point wall_start = Wall::now();
  const Duration start = now();
  while (true) {
    if (interrupted()) return false;
    const auto passed =
        std::chrono::duration_cast<Duration>((Wall::now() - wall_start) * *time_scale_);
    raise_to(std::min(time, start + passed));
    if (now() >= time) return true;
    const auto left = std::chrono::duration_cast<Wall::duration>((time - now()) / *time_scale_);
    std::this_thread::sleep_for(std::clamp<Wall::duration>(left, Wall::duration(1), kPaceSlice));
  }
}

void VirtualClock::raise_to(Duration time) {
  Duration::rep seen = now_ns_.load();
  while (seen < time.count() && !now_ns_.compare_exchange_weak(seen, time.count())) {
  }
}

}  // namespace gonio::sim
