// What ModbusStage does until its axis knows where it is.

#include <fmt/format.h>

#include <cmath>
#include <thread>

#include "drive_link.h"
#include "gonio/modbus_stage/modbus_stage.h"
#include "standing_time.h"

namespace gonio::modbus_stage {

using devices::Clock;
using devices::DeviceErrc;
using devices::DeviceError;
using Host = std::chrono::steady_clock;

void ModbusStage::home(std::chrono::milliseconds timeout) {
  stood_before_home_.reset();
  const Clock::Duration deadline = devices::deadline_after(clock_, timeout);
  { const auto hold = gate_.hold_for_homing(); }
  target_steps_.reset();
  settled_ = false;
  try {
    if (!identified_) identify();
    make_ready_for_homing();
    std::optional<devices::HomeCount> count;
    if (tells()) count.emplace(static_cast<double>(link_->steps()));
    link_->command(profile_.home, {}, unless_stopped());
    wait_for_home(deadline, count ? &*count : nullptr);
    if (count) note_where_it_stood(*count);
    settle(deadline);
    settled_ = true;
  } catch (const DeviceError&) {
    try_stop(
        modbus_bus::Attempts::several);  // an axis that does not know where it is must not drive on
    throw;
  }
  gate_.set_homed(true);
}

void ModbusStage::make_ready_for_homing() {
  DriveState state = link_->state(false);
  require_sound(state);
  if (state.moving) {
    send_stop(modbus_bus::Attempts::several);
    wait_until_standing();
  }
  release_stop(unless_stopped());
  if (state.enabled || profile_.enable.empty()) return;
  link_->command(profile_.enable, {}, unless_stopped());
  const Host::time_point last = Host::now() + profile_.start_time + options_.arrival_patience;
  while (!link_->state(false).enabled) {
    if (Host::now() > last) fail(DeviceErrc::Fault, "the drive does not enable its motor");
    std::this_thread::sleep_for(options_.poll_interval);
  }
}

void ModbusStage::wait_for_home(Clock::Duration deadline, devices::HomeCount* count) {
  const Host::time_point begun = Host::now();
  bool started = false;
  StandingTime standing;
  while (true) {
    // The count first: where the status after it still tells of the search, it was of the old zero.
    const Clock::Duration asked = clock_.now();
    const std::int64_t steps = count != nullptr ? link_->steps() : 0;
    const DriveState state = link_->state(false);
    gate_.require_not_stopped();
    require_sound(state);
    const bool searches = state.moving || (profile_.homed.exists() && !state.homed);
    if (count != nullptr && searches) count->searching(static_cast<double>(steps), asked);
    if (count != nullptr && !searches) count->searches_no_more(clock_.now());
    // Until it has started, the drive may still say what it said after the last homing.
    started = started || searches || Host::now() - begun > profile_.start_time;
    if (started && !state.moving && state.homed && std::abs(state.steps) <= tolerance_steps_) {
      return;
    }
    if (standing.longer_than(started && !state.moving,
                             profile_.start_time + options_.arrival_patience)) {
      fail(DeviceErrc::Timeout, fmt::format("homing has ended without the home mark, at {} steps{}",
                                            state.steps, link_->limit_text()));
    }
    if (clock_.now() >= deadline) fail(DeviceErrc::Timeout, "home mark not found in time");
    std::this_thread::sleep_for(options_.poll_interval);
  }
}

void ModbusStage::note_where_it_stood(const devices::HomeCount& count) {
  const auto way = count.way_to_mark();
  if (!way) return;
  stood_before_home_ = {setup_.home - Angle::from_degrees(way->counts / steps_per_deg_),
                        Angle::from_degrees(way->within / std::abs(steps_per_deg_))};
}

}  // namespace gonio::modbus_stage
