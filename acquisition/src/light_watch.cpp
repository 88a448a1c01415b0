#include "light_watch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <exception>

namespace gonio::acquisition {
namespace {

/// Of an exposure: multiples of the golden section without their whole parts, in order. Of all
/// sequences these have the least in common with any period.
constexpr std::array<double, 8> kInstants{0.090, 0.236, 0.326, 0.472, 0.618, 0.708, 0.854, 0.944};

}  // namespace

LightWatch::LightWatch(GuardedDevices& devices)
    : devices_(devices), lowest_(devices.read_monitor()), highest_(lowest_) {}

void LightWatch::during(std::chrono::nanoseconds exposure) noexcept {
  const DeviceSet& set = devices_.devices();
  if (set.monitor == nullptr) return;
  try {
    const auto begun = devices_.now();
    for (const double instant : kInstants) {
      set.clock->wait_until(begun + std::chrono::nanoseconds(std::llround(
                                        instant * static_cast<double>(exposure.count()))));
      if (devices_.now() - begun > exposure || devices_.stop_requested()) return;
      see(set.monitor->read());
    }
  } catch (const std::exception&) {
    // read() comes next, and says why.
  }
}

double LightWatch::read() {
  const double reading = devices_.read_monitor();
  see(reading);
  return reading;
}

void LightWatch::see(double reading) {
  lowest_ = std::min(lowest_, reading);
  highest_ = std::max(highest_, reading);
}

}  // namespace gonio::acquisition
