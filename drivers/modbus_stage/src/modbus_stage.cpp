#include "gonio/modbus_stage/modbus_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <thread>
#include <utility>

#include "drive_codec.h"

namespace gonio::modbus_stage {

using devices::Clock;
using devices::DeviceErrc;
using devices::DeviceError;

namespace {

using Host = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kSettleSlice{20};  // how late a stop is noticed, session's time
constexpr double kBrakingMargin = 2.0;                 // a drive may brake by a setting of its own
constexpr std::chrono::seconds kBrakingExtra{1};

Clock::Duration deadline_after(Clock::Duration now, std::chrono::milliseconds timeout) {
  constexpr auto kLongest = std::chrono::milliseconds(std::chrono::hours(24 * 365));
  return now + std::clamp(timeout, std::chrono::milliseconds(0), kLongest);
}

/// Since when an axis has been standing, on the host's clock.
class StandingTime {
 public:
  bool longer_than(bool standing, std::chrono::milliseconds limit) {
    if (!standing || !standing_) since_ = Host::now();
    standing_ = standing;
    return standing && Host::now() - since_ > limit;
  }

 private:
  bool standing_ = false;
  Host::time_point since_{};
};

DriveProfile checked(DriveProfile profile) {
  profile.validate();
  return profile;
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
    : bus_(std::move(bus)),
      station_{setup.name, unit},
      setup_(checked(std::move(setup))),
      profile_(checked(std::move(profile))),
      steps_per_deg_(signed_steps(setup_, scale)),
      clock_(clock),
      options_(std::move(options)),
      gate_(setup_.name, setup_.limits) {
  const double per_deg = std::abs(steps_per_deg_);
  try {
    speed_ = speed_number(profile_, per_deg, setup_.max_speed_deg_per_s);
    acceleration_ = acceleration_number(profile_, per_deg, setup_.acceleration_deg_per_s2);
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(fmt::format("axis {}: {}", setup_.name, error.what()));
  }
  for (const Angle end : {setup_.limits.min, setup_.limits.max}) steps_from_angle(end);
  tolerance_steps_ =
      std::max<std::int64_t>(1, std::llround(options_.position_tolerance.degrees() * per_deg));
  const double braking_s = setup_.max_speed_deg_per_s / setup_.acceleration_deg_per_s2;
  braking_time_ = kBrakingExtra + std::chrono::duration_cast<Clock::Duration>(
                                      std::chrono::duration<double>(kBrakingMargin * braking_s));
  leave_out_unconfirmed();
  identify();
}

void ModbusStage::leave_out_unconfirmed() {
  for (const std::string& name : options_.confirmed) {
    if (profile_.find(name) == nullptr) {
      throw std::invalid_argument(
          fmt::format("axis {}: confirmed: found \"{}\", expected a register of the profile {}",
                      setup_.name, name, profile_.name));
    }
  }
  const auto unconfirmed = [&](const std::string& name) {
    const Register* const found = profile_.find(name);
    return found != nullptr && !found->confirmed &&
           std::find(options_.confirmed.begin(), options_.confirmed.end(), name) ==
               options_.confirmed.end();
  };
  // Motion does not depend on these; without them messages say less.
  for (std::string* name :
       {&profile_.alarm_register, &profile_.limit_register, &profile_.following_error_register}) {
    if (unconfirmed(*name)) name->clear();
  }
  const auto require = [&](const std::string& name) {
    if (!unconfirmed(name)) return;
    throw std::invalid_argument(
        fmt::format("axis {}: register \"{}\" (0x{:04X}) of the profile {} is not confirmed by a "
                    "manual; try it "
                    "on the drive, then set confirmed = [\"{}\"]",
                    setup_.name, name, profile_.find(name)->address, profile_.name, name));
  };
  require(profile_.status_register);
  require(profile_.position_register);
  for (const Command* command : {&profile_.enable, &profile_.move, &profile_.home, &profile_.stop,
                                 &profile_.release, &profile_.reset_alarm}) {
    for (const RegisterWrite& write : *command) require(write.register_name);
  }
  for (const DriveProfile::Expected& each : profile_.expected) require(each.register_name);
}

void ModbusStage::identify() {
  for (const DriveProfile::Expected& each : profile_.expected) {
    const std::int64_t found = read(each.register_name);
    if (found != each.value) {
      fail(DeviceErrc::Protocol,
           fmt::format("{}: found {}, the profile {} expects {}: change the setting or the profile",
                       each.register_name, found, profile_.name, each.value));
    }
  }
  read_state(true);
  identified_ = true;
}

void ModbusStage::home(std::chrono::milliseconds timeout) {
  const Clock::Duration deadline = deadline_after(clock_.now(), timeout);
  { const auto hold = gate_.hold_for_homing(); }
  target_steps_.reset();
  try {
    if (!identified_) identify();
    make_ready_for_homing();
    send(profile_.home, true);
    wait_for_home(deadline);
    settle(deadline);
  } catch (const DeviceError&) {
    send_stop();  // an axis that does not know where it is must not drive on
    throw;
  }
  gate_.set_homed(true);
}

void ModbusStage::make_ready_for_homing() {
  DriveState state = read_state(false);
  require_sound(state);
  if (state.moving) {
    if (!send_stop()) fail(DeviceErrc::Timeout, "cannot be stopped before homing");
    wait_until_standing();
  }
  release_stop();
  if (state.enabled || profile_.enable.empty()) return;
  send(profile_.enable, true);
  const Host::time_point last = Host::now() + profile_.start_time + options_.arrival_patience;
  while (!read_state(false).enabled) {
    if (Host::now() > last) fail(DeviceErrc::Fault, "the drive does not enable its motor");
    std::this_thread::sleep_for(options_.poll_interval);
  }
}

void ModbusStage::wait_for_home(Clock::Duration deadline) {
  const Host::time_point begun = Host::now();
  bool started = false;
  StandingTime standing;
  while (true) {
    const DriveState state = read_state(false);
    gate_.require_not_stopped();
    require_sound(state);
    // Until it has started, the drive may still say what it said after the last homing.
    started = started || state.moving || (profile_.homed.exists() && !state.homed) ||
              Host::now() - begun > profile_.start_time;
    if (started && !state.moving && state.homed && std::abs(state.steps) <= tolerance_steps_) {
      return;
    }
    if (standing.longer_than(started && !state.moving,
                             profile_.start_time + options_.arrival_patience)) {
      fail(DeviceErrc::Timeout, fmt::format("homing has ended without the home mark, at {} steps{}",
                                            state.steps, limit_text()));
    }
    if (clock_.now() >= deadline) fail(DeviceErrc::Timeout, "home mark not found in time");
    std::this_thread::sleep_for(options_.poll_interval);
  }
}

void ModbusStage::begin_move_to(Angle target) {
  { const auto hold = gate_.hold_for_move(target); }
  target_steps_ = steps_from_angle(target);
  send(profile_.move, true);
}

Angle ModbusStage::wait_until_settled(std::chrono::milliseconds timeout) {
  gate_.require_ready();
  const Clock::Duration deadline = deadline_after(clock_.now(), timeout);
  StandingTime standing;
  bool has_settled = false;
  while (true) {
    const DriveState state = read_state(false);
    gate_.require_not_stopped();
    require_sound(state);
    if (state.moving) require_following();
    if (on_target(state)) {
      if (has_settled) return angle_from_steps(state.steps);
      settle(deadline);
      has_settled = true;
      continue;
    }
    has_settled = false;
    if (standing.longer_than(!state.moving, profile_.start_time + options_.arrival_patience)) {
      // Short of its target and not done: something held it.
      const bool held = !state.arrived && std::abs(state.steps - *target_steps_) > tolerance_steps_;
      fail(held ? DeviceErrc::Fault : DeviceErrc::Timeout, standing_text(state) + limit_text());
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
  return state.arrived && std::abs(state.steps - *target_steps_) <= tolerance_steps_;
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
  ++stops_;
  { const auto hold = gate_.hold_for_stop(); }
  stop_failed_ = !send_stop();
}

bool ModbusStage::send_stop() noexcept {
  stop_set_ = true;
  bool sent = true;
  try {
    for (const RegisterWrite& write : profile_.stop) {
      const Register& to = *profile_.find(write.register_name);
      bus_->transact(station_, write_request(to, write, {}), {.urgent = true});
    }
  } catch (...) {
    sent = false;  // rearm() says so
  }
  stopped_at_ = clock_.now();
  return sent;
}

void ModbusStage::rearm() {
  const std::uint64_t stops_before = stops_;
  if (gate_.latched()) {
    if (stop_failed_) stop_failed_ = !send_stop();
    wait_until_standing();
    target_steps_.reset();
  }
  const DriveState state = read_state(false);
  if (state.fault) require_sound(state);
  if (!gate_.latched()) return;
  release_stop();
  gate_.rearm();
  if (stops_ != stops_before) {  // one came while this one was looked after
    stop();
    gate_.require_not_stopped();
  }
}

void ModbusStage::wait_until_standing() {
  while (read_state(false).moving) {
    if (clock_.now() - stopped_at_.load() > braking_time_) {
      fail(DeviceErrc::Fault, "moves on after a stop: cut the motor's power");
    }
    std::this_thread::sleep_for(options_.poll_interval);
  }
}

void ModbusStage::reset_alarm() {
  gate_.set_homed(false);
  send(profile_.reset_alarm, false);
  const Host::time_point last = Host::now() + profile_.start_time;
  DriveState state = read_state(false);
  while (state.fault && Host::now() < last) {
    std::this_thread::sleep_for(options_.poll_interval);
    state = read_state(false);
  }
  require_sound(state);
}

DriveState ModbusStage::state() {
  const DriveState state = read_state(true);
  if (gate_.latched() && state.moving && clock_.now() - stopped_at_.load() > braking_time_) {
    fail(DeviceErrc::Fault, "moves on after a stop: cut the motor's power");
  }
  return state;
}

DriveState ModbusStage::read_state(bool with_steps) {
  const auto status = static_cast<std::uint32_t>(read(profile_.status_register));
  DriveState state;
  state.fault = profile_.fault.in(status);
  state.enabled = !profile_.enabled.exists() || profile_.enabled.in(status);
  state.moving = profile_.moving.in(status);
  state.arrived = (!profile_.command_complete.exists() || profile_.command_complete.in(status)) &&
                  (!profile_.in_position.exists() || profile_.in_position.in(status));
  state.homed = !profile_.homed.exists() || profile_.homed.in(status);
  if (with_steps || !state.moving) {
    const double scale = profile_.find(profile_.position_register)->scale;
    state.steps = std::llround(scale * static_cast<double>(read(profile_.position_register)));
  }
  return state;
}

void ModbusStage::require_sound(const DriveState& state) {
  if (state.fault) {
    gate_.set_homed(false);
    fail(DeviceErrc::Fault, alarm_text());
  }
  if (gate_.homed() && !state.homed) {
    gate_.set_homed(false);
    fail(DeviceErrc::NotHomed, "the drive has lost its reference (was it switched off?); home it");
  }
}

void ModbusStage::require_following() {
  if (profile_.following_error_register.empty()) return;
  const Register& from = *profile_.find(profile_.following_error_register);
  const double error = from.scale * static_cast<double>(read(from.name));
  if (std::abs(error) <= profile_.max_following_error) return;
  send_stop();
  gate_.set_homed(false);
  fail(DeviceErrc::Fault, fmt::format("following error {:g}, allowed {:g}: is the axis blocked?",
                                      error, profile_.max_following_error));
}

std::string ModbusStage::alarm_text() {
  if (profile_.alarm_register.empty()) return "the drive reports an alarm; see its display";
  const std::int64_t code = read(profile_.alarm_register);
  const auto known = std::find_if(profile_.alarm_texts.begin(), profile_.alarm_texts.end(),
                                  [&](const auto& each) { return each.code == code; });
  return fmt::format("the drive's alarm 0x{:02X}: {}", code,
                     known == profile_.alarm_texts.end() ? "see its manual" : known->text);
}

std::string ModbusStage::limit_text() {
  if (profile_.limit_register.empty()) return "";
  const auto bits = static_cast<std::uint32_t>(read(profile_.limit_register));
  if (profile_.limit_forward.in(bits)) return "; the forward limit switch is on";
  if (profile_.limit_reverse.in(bits)) return "; the reverse limit switch is on";
  return "";
}

std::string ModbusStage::standing_text(const DriveState& state) const {
  return fmt::format("{}: it stands at {:.4f} deg, target {:.4f} deg",
                     state.arrived ? "off its target"
                                   : "not in position (limit switch, obstacle, or a lost step?)",
                     angle_from_steps(state.steps).degrees(),
                     angle_from_steps(*target_steps_).degrees());
}

std::vector<std::uint16_t> ModbusStage::ask(const modbus_bus::Request& request,
                                            const modbus_bus::Manner& manner) {
  try {
    return bus_->transact(station_, request, manner);
  } catch (const DeviceError& error) {
    const bool silent = error.code() == DeviceErrc::Timeout;
    if (silent || error.code() == DeviceErrc::Disconnected) identified_ = false;
    // Whoever was silent may have been switched off; it counts from 0 again, and may not know it.
    const bool would_know = profile_.absolute_encoder || profile_.homed.exists();
    if (error.code() == DeviceErrc::Disconnected || (silent && !would_know)) {
      gate_.set_homed(false);
    }
    throw;
  }
}

std::int64_t ModbusStage::read(const std::string& register_name) {
  const Register& from = *profile_.find(register_name);
  return number_from_words(from, ask(read_request(from), {}));
}

void ModbusStage::send(const Command& command, bool starts_motion) {
  const MoveNumbers numbers{target_steps_.value_or(0), speed_, acceleration_, acceleration_};
  for (const RegisterWrite& write : command) {
    modbus_bus::Manner manner{.repeatable = write.repeatable};
    if (starts_motion) manner.given_up = [this] { return gate_.latched(); };
    ask(write_request(*profile_.find(write.register_name), write, numbers), manner);
  }
}

void ModbusStage::release_stop() {
  if (!stop_set_) return;
  send(profile_.release, false);
  stop_set_ = false;
}

void ModbusStage::fail(DeviceErrc code, const std::string& message) const {
  throw DeviceError(code, setup_.name, message);
}

Angle ModbusStage::angle_from_steps(std::int64_t steps) const {
  return setup_.home + Angle::from_degrees(static_cast<double>(steps) / steps_per_deg_);
}

std::int32_t ModbusStage::steps_from_angle(Angle angle) const {
  const double steps = std::round((angle - setup_.home).degrees() * steps_per_deg_);
  if (!(std::abs(steps) <= std::numeric_limits<std::int32_t>::max())) {
    throw std::invalid_argument(
        fmt::format("axis {}: steps_per_deg: found {:g}, expected limits within 32 bits of steps",
                    setup_.name, std::abs(steps_per_deg_)));
  }
  return static_cast<std::int32_t>(steps);
}

}  // namespace gonio::modbus_stage
