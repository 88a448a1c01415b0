#include "stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace gonio::sim {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

// Limits are inclusive; this much is rounding of degrees to radians (as in the rig description).
constexpr double kLimitToleranceRad = 1e-9;

devices::Clock::Duration later(devices::Clock::Duration now, std::chrono::milliseconds timeout) {
  constexpr auto kLongest = std::chrono::milliseconds(std::chrono::hours(24 * 365));
  return now + std::clamp(timeout, std::chrono::milliseconds(0), kLongest);
}

}  // namespace

SimRotationStage::SimRotationStage(const rig::Axis& axis, Joint& joint, VirtualClock& clock)
    : name_(axis.name), limits_{axis.min, axis.max}, joint_(joint), clock_(clock) {}

void SimRotationStage::home(std::chrono::milliseconds timeout) {
  devices::Clock::Duration settled;
  {
    const std::lock_guard lock(mutex_);
    refuse_when_stopped();
    homed_ = false;
    settled = joint_.start_homing(clock_.now());
  }
  try {
    wait_for(settled, timeout, "home mark not found");
  } catch (const DeviceError&) {
    joint_.brake(clock_.now());  // an axis that does not know where it is must not drive on
    throw;
  }
  joint_.finish_homing();
  homed_ = true;
}

void SimRotationStage::begin_move_to(Angle target) {
  const std::lock_guard lock(mutex_);
  refuse_when_stopped();
  refuse_when_not_homed();
  const double radians = target.radians();
  if (!(radians >= limits_.min.radians() - kLimitToleranceRad &&
        radians <= limits_.max.radians() + kLimitToleranceRad)) {
    throw DeviceError(DeviceErrc::LimitViolation, name_,
                      fmt::format("target {:.6g} deg, limits {:.6g} .. {:.6g} deg",
                                  target.degrees(), limits_.min.degrees(), limits_.max.degrees()));
  }
  joint_.move_to(target, clock_.now());
}

Angle SimRotationStage::wait_until_settled(std::chrono::milliseconds timeout) {
  {
    const std::lock_guard lock(mutex_);
    refuse_when_stopped();
    refuse_when_not_homed();
  }
  wait_for(joint_.settled_at(), timeout, "not settled");
  return joint_.encoder(clock_.now());
}

void SimRotationStage::wait_for(devices::Clock::Duration settled, std::chrono::milliseconds timeout,
                                const char* what) {
  const devices::Clock::Duration deadline = later(clock_.now(), timeout);
  clock_.wait_until(std::min(settled, deadline), [this] { return stopped(); });
  {
    const std::lock_guard lock(mutex_);
    refuse_when_stopped();
  }
  if (settled > deadline) {
    throw DeviceError(DeviceErrc::Timeout, name_,
                      fmt::format("{} within {} ms", what, timeout.count()));
  }
}

void SimRotationStage::stop() noexcept {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  joint_.brake(clock_.now());
}

void SimRotationStage::rearm() {
  const std::lock_guard lock(mutex_);
  stopped_ = false;
}

bool SimRotationStage::stopped() const {
  const std::lock_guard lock(mutex_);
  return stopped_;
}

void SimRotationStage::refuse_when_stopped() const {
  if (stopped_) throw DeviceError(DeviceErrc::Stopped, name_, "stop() is latched; rearm() first");
}

void SimRotationStage::refuse_when_not_homed() const {
  if (!homed_) throw DeviceError(DeviceErrc::NotHomed, name_, "home() first");
}

}  // namespace gonio::sim
