#include "gonio/apt_stage/apt_stage.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "apt_link.h"

namespace gonio::apt_stage {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

// Between two questions about a move; session time, so that a fast emulated rig is asked as often
// as it moves.
constexpr std::chrono::milliseconds kPollPause{10};
// A stopped axis stands after its braking time; this much longer it is believed.
constexpr std::chrono::milliseconds kStopPatience{1000};
// One that stands still this long away from its target has not heard of the move, or lost it.
constexpr std::chrono::milliseconds kStandingPatience{2000};

std::int32_t in_units(double value, const char* what, const std::string& axis) {
  const double rounded = std::round(value);
  if (!(std::abs(rounded) <= std::numeric_limits<std::int32_t>::max())) {
    throw std::invalid_argument(
        fmt::format("axis {}: {}: {} units do not fit the stage's counter", axis, what, value));
  }
  return static_cast<std::int32_t>(rounded);
}

}  // namespace

AptStage::AptStage(std::shared_ptr<usb_bus::ByteStream> port, devices::AxisSetup setup,
                   AptModel model, bool reversed, devices::Clock& clock,
                   HomeDirection home_direction, bool counts_until_homed)
    : setup_(std::move(setup)),
      model_(std::move(model)),
      direction_(reversed ? -1.0 : 1.0),
      home_direction_(home_direction),
      counts_until_homed_(counts_until_homed),
      clock_(clock),
      gate_(setup_.name, setup_.limits),
      link_(std::make_unique<AptLink>(std::move(port))) {
  setup_.validate();
  model_.validate();
  const auto at_most = [&](const char* field, double value, double most) {
    if (value > most) {
      throw std::invalid_argument(fmt::format("axis {}: {}: found {}, expected at most {} ({})",
                                              setup_.name, field, value, most, model_.name));
    }
  };
  at_most("max_speed_deg_per_s", setup_.max_speed_deg_per_s, model_.max_speed_deg_per_s);
  at_most("acceleration_deg_per_s2", setup_.acceleration_deg_per_s2,
          model_.max_acceleration_deg_per_s2);
  steps_at(setup_.limits.min);  // both ends must be countable
  steps_at(setup_.limits.max);
  identify();
  set_up();
  // Homed since it was switched on, by whoever drove it before: that is as good as our own.
  gate_.set_homed(confirmed_status().has(status::kHomed));
}

AptStage::~AptStage() = default;

void AptStage::identify() {
  // In this order at every start: the unit learns whom it talks to, then says nothing unasked.
  link_->send(short_message(MessageId::HW_NO_FLASH_PROGRAMMING));
  link_->send(short_message(MessageId::HW_STOP_UPDATEMSGS));
  const HardwareInfo found =
      hardware_info(link_->ask(short_message(MessageId::HW_REQ_INFO), MessageId::HW_GET_INFO))
          .value();
  if (found.model != model_.name) {
    throw DeviceError(DeviceErrc::Protocol, name(),
                      fmt::format("found a {} (serial {}), expected a {}; correct the rig file",
                                  found.model, found.serial, model_.name));
  }
  if (identity_.serial != 0 && found.serial != identity_.serial) {
    throw DeviceError(DeviceErrc::Protocol, name(),
                      fmt::format("serial {} came back as {}; plug the right stage in",
                                  identity_.serial, found.serial));
  }
  identity_ = found;
}

HomeParams AptStage::search_at(double deg_per_s) const {
  HomeParams home;
  const bool forward = (home_direction_ == HomeDirection::rising) == (direction_ > 0.0);
  home.direction = forward ? 1 : 2;
  home.limit_switch = forward ? 4 : 1;  // the one that lies that way
  home.velocity =
      in_units(std::min(deg_per_s, setup_.max_speed_deg_per_s) * model_.velocity_per_deg_s,
               "velocity", name());
  home.offset = in_units(model_.home_offset_deg * model_.steps_per_deg, "home offset", name());
  return home;
}

void AptStage::set_up() {
  VelocityParams params;
  params.acceleration = in_units(setup_.acceleration_deg_per_s2 * model_.acceleration_per_deg_s2,
                                 "acceleration", name());
  params.maximum =
      in_units(setup_.max_speed_deg_per_s * model_.velocity_per_deg_s, "velocity", name());
  const HomeParams home = search_at(model_.home_speed_deg_per_s);

  // The unit counts what was not acknowledged over all programs that ever asked it.
  link_->acknowledge();
  link_->send(enable_channel(true));
  link_->send(set_velocity(params));
  link_->send(set_home(home));
  const auto taken_velocity = velocity_params(link_->ask(
      short_message(MessageId::MOT_REQ_VELPARAMS, kChannel), MessageId::MOT_GET_VELPARAMS));
  const auto taken_home = home_params(link_->ask(
      short_message(MessageId::MOT_REQ_HOMEPARAMS, kChannel), MessageId::MOT_GET_HOMEPARAMS));
  if (taken_velocity != params || taken_home != home) {
    throw DeviceError(DeviceErrc::Protocol, name(),
                      "the stage did not take its speed or homing settings; switch it off and on");
  }
}

void AptStage::reconnect() {
  gate_.set_homed(false);
  link_->port().reconnect(kReconnect);
  link_->reset();
  try {
    identify();
  } catch (...) {
    link_->port().disconnect();  // so that the next attempt begins with all of this again
    throw;
  }
}

StatusUpdate AptStage::confirmed_status() {
  const StatusUpdate status = link_->ask_status();
  const bool lost_home = gate_.homed() && !status.has(status::kHomed);
  if (alarms_in(status) == 0 && !lost_home) return status;
  link_->resynchronise();
  return link_->ask_status();
}

StatusUpdate AptStage::checked_status() {
  const StatusUpdate status = losing_home([&] { return confirmed_status(); });
  require_no_alarm(status);
  if (gate_.homed() && !status.has(status::kHomed)) {
    gate_.set_homed(false);
    target_.reset();
    throw DeviceError(DeviceErrc::NotHomed, name(),
                      "the stage lost its home (switched off and on?); home() again");
  }
  return status;
}

std::uint32_t AptStage::alarms_in(const StatusUpdate& status) const {
  std::uint32_t alarms = status.bits & model_.alarm_bits;
  const double from_home_deg = std::abs(status.position / model_.steps_per_deg);
  if (from_home_deg > model_.home_switch_deg) alarms |= status.bits & status::kLimits;
  return alarms;
}

void AptStage::require_no_alarm(const StatusUpdate& status) const {
  const std::uint32_t alarms = alarms_in(status);
  if (alarms == 0) return;
  throw DeviceError(DeviceErrc::Fault, name(),
                    fmt::format("the stage reports: {}; look at it, then switch it off and on or "
                                "home() it (status {:#010x})",
                                describe_status(alarms), status.bits));
}

void AptStage::begin_move_to(Angle target) {
  gate_.require_ready();
  if (link_->port().connected()) {
    checked_status();
    losing_home([&] { link_->forget(); });
  }
  const auto hold = gate_.hold_for_move(target);
  const std::int32_t steps = steps_at(target);
  losing_home([&] { link_->send(move_absolute(steps)); });
  target_ = steps;
  settled_at_.reset();
}

Angle AptStage::wait_until_settled(std::chrono::milliseconds timeout) {
  gate_.require_ready();
  const Time deadline = devices::deadline_after(clock_, timeout);
  if (target_ && !settled_at_) wait_for_arrival(deadline);
  while (true) {
    if (settled_at_) wait_for_settling(deadline, timeout);
    const StatusUpdate status = checked_status();
    gate_.require_not_stopped();
    if (!status.has(status::kInMotion)) return joint_at(status.position);
    // Taken over on its way, or turned at its own panel.
    wait_until_standing(deadline, timeout);
    settled_at_ = clock_.now() + setup_.settle;
  }
}

void AptStage::wait_until_standing(Time deadline, std::chrono::milliseconds timeout) {
  while (checked_status().has(status::kInMotion)) {
    gate_.require_not_stopped();
    if (clock_.now() >= deadline) {
      throw DeviceError(
          DeviceErrc::Timeout, name(),
          fmt::format("still moving after {} ms, and nobody sent it; stop() it", timeout.count()));
    }
    pause();
  }
}

void AptStage::wait_for_arrival(Time deadline) {
  const Time begin = clock_.now();
  Time went_on_at = begin;  // when it last moved, or was where it should be
  while (true) {
    const StatusUpdate status = checked_status();
    gate_.require_not_stopped();
    const bool completed = link_->notices().completed || status.has(status::kSettled);
    const bool moving = status.has(status::kInMotion);
    const bool there = distance_deg(status, *target_) <= model_.in_position_deg;
    if (completed && !moving && there) break;
    const Time now = clock_.now();
    if (moving || there) went_on_at = now;
    if (now >= deadline || now >= went_on_at + kStandingPatience) {
      throw DeviceError(
          DeviceErrc::Timeout, name(),
          fmt::format("not in position within {} ms: {}, {}, {:.4f} deg from its target",
                      std::chrono::duration_cast<std::chrono::milliseconds>(now - begin).count(),
                      moving ? "still moving" : "not moving",
                      completed ? "reported as completed" : "not reported as completed",
                      distance_deg(status, *target_)));
    }
    pause();
  }
  settled_at_ = clock_.now() + setup_.settle;
}

void AptStage::wait_for_settling(Time deadline, std::chrono::milliseconds timeout) {
  while (clock_.now() < *settled_at_) {
    gate_.require_not_stopped();
    if (clock_.now() >= deadline) {
      throw DeviceError(DeviceErrc::Timeout, name(),
                        fmt::format("not settled within {} ms", timeout.count()));
    }
    clock_.wait_until(std::min({*settled_at_, deadline, clock_.now() + kPollPause}));
  }
}

void AptStage::pause() const { clock_.wait_until(clock_.now() + kPollPause); }

void AptStage::stop() noexcept {
  const auto hold = gate_.hold_for_stop();
  try {
    link_->send(move_stop(StopMode::immediate));
  } catch (const std::exception&) {
    // Nothing else can be done here; rearm() does not let an axis go on that did not stop.
  }
}

void AptStage::require_standing() { stand_still(); }

StatusUpdate AptStage::stand_still() {
  const double braking_s = setup_.max_speed_deg_per_s / setup_.acceleration_deg_per_s2;
  const Time deadline = clock_.now() + kStopPatience +
                        std::chrono::duration_cast<Time>(std::chrono::duration<double>(braking_s));
  while (true) {
    const StatusUpdate status = losing_home([&] { return confirmed_status(); });
    if (!status.has(status::kInMotion)) return status;
    if (clock_.now() >= deadline) {
      throw DeviceError(DeviceErrc::Fault, name(),
                        "the stage ignored stop and moves on; cut its power");
    }
    losing_home([&] { link_->send(move_stop(StopMode::immediate)); });
    pause();
  }
}

void AptStage::rearm() {
  if (!gate_.latched()) return;
  const std::uint64_t stops = gate_.stops();
  try {
    StatusUpdate status = stand_still();
    status.bits &= ~status::kLimits;  // home() drives off a switch, and needs this first
    require_no_alarm(status);
  } catch (const DeviceError& error) {
    // What has gone does not move for us; home(), which reconnects, will tell.
    if (error.code() != DeviceErrc::Disconnected) throw;
  }
  target_.reset();
  settled_at_.reset();
  gate_.rearm(stops);
}

std::int32_t AptStage::steps_at(Angle joint) const {
  const double deg = direction_ * (joint - setup_.home).degrees();
  return in_units(deg * model_.steps_per_deg, "position", setup_.name);
}

Angle AptStage::joint_at(std::int32_t steps) const {
  return setup_.home + Angle::from_degrees(direction_ * steps / model_.steps_per_deg);
}

double AptStage::distance_deg(const StatusUpdate& status, std::int32_t target) const {
  return std::abs(static_cast<double>(status.position) - static_cast<double>(target)) /
         model_.steps_per_deg;
}

}  // namespace gonio::apt_stage
