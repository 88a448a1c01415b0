#include "gonio/modbus_stage/modbus_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>
#include <utility>

#include "drive_codec.h"
#include "drive_link.h"
#include "standing_time.h"

namespace gonio::modbus_stage {

using devices::Clock;
using devices::DeviceErrc;
using devices::DeviceError;

namespace {

using Host = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kSettleSlice{20};  // how late a stop is noticed, session's time
constexpr double kBrakingMargin = 2.0;                 // a drive may brake by a setting of its own
constexpr std::chrono::seconds kBrakingExtra{1};
constexpr int kMoveAttempts = 3;

bool answer_was_lost(DeviceErrc code) {
  return code == DeviceErrc::Timeout || code == DeviceErrc::Protocol;
}

bool all_repeatable(const Command& command) {
  return std::all_of(command.begin(), command.end(),
                     [](const RegisterWrite& write) { return write.repeatable; });
}

devices::AxisSetup checked(devices::AxisSetup setup) {
  setup.validate();
  return setup;
}

double signed_steps(const devices::AxisSetup& setup, const DriveScale& scale) {
  if (!(scale.steps_per_deg > 0.0 && std::isfinite(scale.steps_per_deg))) {
    throw std::invalid_argument(fmt::format("axis {}: steps_per_deg: found {:g}, expected above 0",
                                            setup.name, scale.steps_per_deg));
  }
  return scale.reversed ? -scale.steps_per_deg : scale.steps_per_deg;
}

}  // namespace

ModbusStage::ModbusStage(std::shared_ptr<modbus_bus::ModbusBus> bus, int unit,
                         devices::AxisSetup setup, DriveProfile profile, DriveScale scale,
                         Clock& clock, StageOptions options)
    : setup_(checked(std::move(setup))),
      steps_per_deg_(signed_steps(setup_, scale)),
      clock_(clock),
      options_(std::move(options)),
      gate_(setup_.name, setup_.limits),
      link_(std::make_unique<DriveLink>(std::move(bus), modbus_bus::Station{setup_.name, unit},
                                        std::move(profile), options_.confirmed,
                                        [this](DeviceErrc code) { link_failed(code); })),
      profile_(link_->profile()) {
  if (options_.counts_until_homed && profile_.absolute_encoder) {
    throw std::invalid_argument(
        fmt::format("axis {}: counts_until_homed: found true, expected false with the profile {}: "
                    "it homes by its absolute encoder, which looks for no mark",
                    setup_.name, profile_.name));
  }
  const double per_deg = std::abs(steps_per_deg_);
  try {
    speed_ = speed_number(profile_, per_deg, setup_.max_speed_deg_per_s);
    acceleration_ = acceleration_number(profile_, per_deg, setup_.acceleration_deg_per_s2);
    for (const Angle end : {setup_.limits.min, setup_.limits.max}) {
      link_->require_encodable(profile_.move, numbers_to(steps_from_angle(end)));
    }
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(fmt::format("axis {}: {}", setup_.name, error.what()));
  }
  tolerance_steps_ =
      std::max<std::int64_t>(1, std::llround(options_.position_tolerance.degrees() * per_deg));
  const double braking_s = setup_.max_speed_deg_per_s / setup_.acceleration_deg_per_s2;
  braking_time_ = kBrakingExtra + std::chrono::duration_cast<Clock::Duration>(
                                      std::chrono::duration<double>(kBrakingMargin * braking_s));
  const DriveState state = identify();
  // Homed since it was switched on, by whoever drove it before: that is as good as our own.
  gate_.set_homed(profile_.homed.exists() && state.homed && !state.fault);
}

ModbusStage::~ModbusStage() = default;

DriveState ModbusStage::identify() {
  link_->require_expected_settings();
  const DriveState state = link_->state(true);
  identified_ = true;
  return state;
}

void ModbusStage::link_failed(DeviceErrc code) {
  const bool silent = code == DeviceErrc::Timeout;
  if (!silent && code != DeviceErrc::Disconnected) return;
  identified_ = false;
  // Whoever was silent may have been switched off; it counts from 0 again, and may not know it.
  const bool would_know = profile_.absolute_encoder || profile_.homed.exists();
  if (!silent || !would_know) gate_.set_homed(false);
}

void ModbusStage::begin_move_to(Angle target) {
  { const auto hold = gate_.hold_for_move(target); }
  const std::int32_t steps = steps_from_angle(target);
  for (int attempt = 1;; ++attempt) {
    require_reference();
    release_stop(unless_stopped());
    note_move(steps);
    try {
      link_->command_once(profile_.move, numbers_to(steps), unless_stopped());
      return note_move(steps);
    } catch (const DeviceError& error) {
      // The bus must not send it again by itself: without an answer the drive may have lost its
      // reference meanwhile, and is asked before it is told again.
      if (!answer_was_lost(error.code()) || !gate_.homed() || !all_repeatable(profile_.move) ||
          attempt == kMoveAttempts) {
        throw;
      }
    }
  }
}

void ModbusStage::require_reference() {
  require_sound(identified_ ? link_->state(false) : identify());
}

void ModbusStage::note_move(std::int32_t steps) {
  target_steps_ = steps;
  moved_at_ = Host::now();
  started_ = false;
  settled_ = false;
}

Angle ModbusStage::wait_until_settled(std::chrono::milliseconds timeout) {
  gate_.require_ready();
  const Clock::Duration deadline = devices::deadline_after(clock_, timeout);
  StandingTime standing;
  while (true) {
    const DriveState state = link_->state(false);
    gate_.require_not_stopped();
    require_sound(state);
    if (state.moving) require_following();
    // Until then it may be that of before, and the axis near its target because the way is short.
    started_ = started_ || state.moving || Host::now() - moved_at_ > profile_.start_time;
    if (on_target(state)) {
      if (settled_) return angle_from_steps(state.steps);
      settle(deadline);
      settled_ = true;
      continue;
    }
    settled_ = false;
    if (standing.longer_than(!state.moving, profile_.start_time + options_.arrival_patience)) {
      // Short of its target and not done: something held it.
      const bool held = !state.arrived && std::abs(state.steps - *target_steps_) > tolerance_steps_;
      fail(held ? DeviceErrc::Fault : DeviceErrc::Timeout,
           standing_text(state) + link_->limit_text());
    }
    if (clock_.now() >= deadline) {
      fail(DeviceErrc::Timeout, state.moving
                                    ? fmt::format("not settled within {} ms", timeout.count())
                                    : standing_text(state));
    }
    std::this_thread::sleep_for(options_.poll_interval);
  }
}

bool ModbusStage::on_target(const DriveState& state) const {
  if (state.moving) return false;
  if (!target_steps_) return true;
  return started_ && state.arrived && std::abs(state.steps - *target_steps_) <= tolerance_steps_;
}

void ModbusStage::settle(Clock::Duration deadline) {
  const Clock::Duration settled = clock_.now() + setup_.settle;
  while (clock_.now() < settled) {
    if (clock_.now() >= deadline) fail(DeviceErrc::Timeout, "not settled in time");
    clock_.wait_until(std::min<Clock::Duration>(settled, clock_.now() + kSettleSlice));
    gate_.require_not_stopped();
  }
}

void ModbusStage::stop() noexcept {
  { const auto hold = gate_.hold_for_stop(); }
  try_stop(modbus_bus::Attempts::one);
}

void ModbusStage::send_stop(modbus_bus::Attempts attempts) {
  stop_set_ = true;
  stop_failed_ = true;
  try {
    link_->stop(attempts);
    stop_failed_ = false;
  } catch (const DeviceError&) {
    stopped_at_ = clock_.now();
    throw;
  }
  stopped_at_ = clock_.now();
}

bool ModbusStage::try_stop(modbus_bus::Attempts attempts) noexcept {
  try {
    send_stop(attempts);
    return true;
  } catch (...) {  // whoever asks for the state next hears why
    return false;
  }
}

std::function<bool()> ModbusStage::unless_stopped() const {
  return [this] { return gate_.latched(); };
}

void ModbusStage::rearm() {
  const std::uint64_t stops = gate_.stops();
  const bool latched = gate_.latched();
  if (latched) {
    require_standing();
    target_steps_.reset();
    settled_ = false;
  }
  const DriveState state = link_->state(false);
  if (state.fault) require_sound(state);
  // Also where nobody here has stopped it: another process may have.
  release_stop([&] { return gate_.stops() != stops; });
  if (latched) gate_.rearm(stops);
}

void ModbusStage::require_standing() {
  if (!gate_.latched()) stop();
  if (stop_failed_) send_stop(modbus_bus::Attempts::several);
  wait_until_standing();
}

void ModbusStage::wait_until_standing() {
  while (link_->state(false).moving) {
    if (clock_.now() - stopped_at_.load() > braking_time_) {
      fail(DeviceErrc::Fault, "moves on after a stop: cut the motor's power");
    }
    std::this_thread::sleep_for(options_.poll_interval);
  }
}

void ModbusStage::reset_alarm() {
  gate_.set_homed(false);
  link_->command(profile_.reset_alarm);
  const Host::time_point last = Host::now() + profile_.start_time;
  DriveState state = link_->state(false);
  while (state.fault && Host::now() < last) {
    std::this_thread::sleep_for(options_.poll_interval);
    state = link_->state(false);
  }
  require_sound(state);
}

DriveState ModbusStage::state() {
  const DriveState state = link_->state(true);
  if (gate_.latched() && state.moving && clock_.now() - stopped_at_.load() > braking_time_) {
    fail(DeviceErrc::Fault, "moves on after a stop: cut the motor's power");
  }
  return state;
}

void ModbusStage::require_sound(const DriveState& state) {
  if (state.fault) {
    gate_.set_homed(false);
    fail(DeviceErrc::Fault, link_->alarm_text());
  }
  if (gate_.homed() && !state.homed) {
    gate_.set_homed(false);
    fail(DeviceErrc::NotHomed, "the drive has lost its reference (was it switched off?); home it");
  }
}

void ModbusStage::require_following() {
  const double error = link_->following_error();
  if (std::abs(error) <= profile_.max_following_error) return;
  try_stop(modbus_bus::Attempts::several);
  gate_.set_homed(false);
  fail(DeviceErrc::Fault, fmt::format("following error {:g}, allowed {:g}: is the axis blocked?",
                                      error, profile_.max_following_error));
}

std::string ModbusStage::standing_text(const DriveState& state) const {
  return fmt::format("{}: it stands at {:.4f} deg, target {:.4f} deg",
                     state.arrived ? "off its target"
                                   : "not in position (limit switch, obstacle, or a lost step?)",
                     angle_from_steps(state.steps).degrees(),
                     angle_from_steps(*target_steps_).degrees());
}

void ModbusStage::release_stop(const std::function<bool()>& given_up) {
  // Before it is sent: a stop that comes behind it sets it again.
  if (!stop_set_.exchange(false)) return;
  try {
    link_->command(profile_.release, {}, given_up);
  } catch (const DeviceError&) {
    stop_set_ = true;
    throw;
  }
}

void ModbusStage::fail(DeviceErrc code, const std::string& message) const {
  throw DeviceError(code, setup_.name, message);
}

MoveNumbers ModbusStage::numbers_to(std::int32_t steps) const {
  return {steps, speed_, acceleration_, acceleration_};
}

Angle ModbusStage::angle_from_steps(std::int64_t steps) const {
  return setup_.home + Angle::from_degrees(static_cast<double>(steps) / steps_per_deg_);
}

std::int32_t ModbusStage::steps_from_angle(Angle angle) const {
  const double steps = std::round((angle - setup_.home).degrees() * steps_per_deg_);
  if (!(std::abs(steps) <= std::numeric_limits<std::int32_t>::max())) {
    throw std::invalid_argument(
        fmt::format("steps_per_deg: found {:g}, expected limits within 32 bits of steps",
                    std::abs(steps_per_deg_)));
  }
  return static_cast<std::int32_t>(steps);
}

}  // namespace gonio::modbus_stage
