#include "stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace gonio::sim {

using devices::DeviceErrc;
using devices::DeviceError;

SimRotationStage::SimRotationStage(const rig::Axis& axis, Joint& joint, VirtualClock& clock,
                                   bool tells)
    : gate_(axis.name, {axis.min, axis.max}), joint_(joint), clock_(clock), tells_(tells) {}

void SimRotationStage::home(std::chrono::milliseconds timeout) {
  joint_.forget_homing();
  devices::Clock::Duration settled;
  {
    const auto hold = gate_.hold_for_homing();
    settled = joint_.start_homing(clock_.now());
  }
  try {
    wait_for(settled, timeout, "home mark not found");
  } catch (const DeviceError&) {
    joint_.brake(clock_.now());  // an axis that does not know where it is must not drive on
    throw;
  }
  joint_.finish_homing();
  gate_.set_homed(true);
}

void SimRotationStage::begin_move_to(Angle target) {
  const auto hold = gate_.hold_for_move(target);
  joint_.move_to(target, clock_.now());
}

Angle SimRotationStage::wait_until_settled(std::chrono::milliseconds timeout) {
  gate_.require_ready();
  wait_for(joint_.settled_at(), timeout, "not settled");
  return joint_.encoder(clock_.now());
}

void SimRotationStage::wait_for(devices::Clock::Duration settled, std::chrono::milliseconds timeout,
                                const char* what) {
  const devices::Clock::Duration deadline = devices::deadline_after(clock_, timeout);
  clock_.wait_until(std::min(settled, deadline), [this] { return gate_.latched(); });
  gate_.require_not_stopped();
  if (settled > deadline) {
    throw DeviceError(DeviceErrc::Timeout, name(),
                      fmt::format("{} within {} ms", what, timeout.count()));
  }
}

void SimRotationStage::stop() noexcept {
  const auto hold = gate_.hold_for_stop();
  joint_.brake(clock_.now());
}

std::optional<devices::StoodBeforeHome> SimRotationStage::stood_before_home() const {
  const std::optional<Angle> stood = joint_.stood_before_home();
  if (!stood || !tells_) return std::nullopt;
  return devices::StoodBeforeHome{*stood, Angle()};
}

void SimRotationStage::rearm() { gate_.rearm(gate_.stops()); }

}  // namespace gonio::sim
