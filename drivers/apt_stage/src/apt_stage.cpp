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
                   HomeDirection home_direction)
    : setup_(std::move(setup)),
      model_(std::move(model)),
      direction_(reversed ? -1.0 : 1.0),
      home_direction_(home_direction),
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

void AptStage::set_up() {
  const auto velocity = [&](double deg_per_s) {
    return in_units(deg_per_s * model_.velocity_per_deg_s, "velocity", name());
  };
  VelocityParams params;
  params.acceleration = in_units(setup_.acceleration_deg_per_s2 * model_.acceleration_per_deg_s2,
                                 "acceleration", name());
  params.maximum = velocity(setup_.max_speed_deg_per_s);
  HomeParams home;
  const bool forward = (home_direction_ == HomeDirection::rising) == (direction_ > 0.0);
  home.direction = forward ? 1 : 2;
  home.limit_switch = forward ? 4 : 1;  // the one that lies that way
  home.velocity = velocity(std::min(model_.home_speed_deg_per_s, setup_.max_speed_deg_per_s));
  home.offset = in_units(model_.home_offset_deg * model_.steps_per_deg, "home offset", name());

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

/// Runs what talks to the unit; one that has gone is not homed when it comes back.
template <class Act>
auto AptStage::losing_home(Act act) {
  try {
    return act();
  } catch (const DeviceError& error) {
    if (error.code() == DeviceErrc::Disconnected) {
      gate_.set_homed(false);
      target_.reset();
    }
    throw;
  }
}

/// Messages have no checksum: half of one with the next behind it can look like anything. What
/// would end a session is believed when it is said twice.
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

void AptStage::home(std::chrono::milliseconds timeout) {
  gate_.require_not_stopped();
  const Time deadline = devices::deadline_after(clock_, timeout);
  if (!link_->port().connected()) reconnect();
  losing_home([&] {
    set_up();  // it may have been switched off since
    StatusUpdate before = confirmed_status();
    const bool at_switch = before.has(status::kLimits);
    before.bits &= ~status::kLimits;  // homing drives off a switch
    require_no_alarm(before);
    const bool knows_where = gate_.homed() && before.has(status::kHomed) && !at_switch;
    if (knows_where) go_before_the_mark(deadline);
    link_->forget();  // before the hold: stop() waits for that
    {
      const auto hold = gate_.hold_for_homing();
      target_.reset();
      settled_at_.reset();
      link_->send(move_home());
    }
    try {
      wait_for_home(deadline, timeout);
    } catch (const DeviceError&) {
      // An axis that does not know where it is must not drive on.
      if (link_->port().connected()) link_->send(move_stop(StopMode::immediate));
      throw;
    }
  });
  gate_.set_homed(true);
}

/// To where the search begins: it turns in one direction only, and past the mark it would go on for
/// a whole turn.
void AptStage::go_before_the_mark(Time deadline) {
  try {
    // Signs are those of the search; the mark is at 0.
    const double towards = home_direction_ == HomeDirection::falling ? -1.0 : 1.0;
    const Angle end = towards < 0.0 ? setup_.limits.max : setup_.limits.min;
    const double room_deg = -towards * (end - setup_.home).degrees();
    const double run_up_deg = std::min(2.0 * model_.home_switch_deg, room_deg);
    const StatusUpdate status = checked_status();
    const double before_deg = -towards * (joint_at(status.position) - setup_.home).degrees();
    // More than a turn before it the search would end at the same mark too early.
    constexpr double kTurnDeg = 360.0;
    const bool is_before = before_deg >= run_up_deg && before_deg <= kTurnDeg - run_up_deg;
    if (is_before && !status.has(status::kInMotion)) return;
    begin_move_to(setup_.home + Angle::from_degrees(-towards * run_up_deg));
    wait_for_arrival(deadline);
  } catch (const DeviceError&) {
    gate_.set_homed(false);
    target_.reset();
    if (link_->port().connected()) link_->send(move_stop(StopMode::immediate));
    throw;
  }
}

void AptStage::wait_for_home(Time deadline, std::chrono::milliseconds timeout) {
  bool seen_homing = false;
  while (true) {
    gate_.require_not_stopped();
    StatusUpdate status = confirmed_status();
    seen_homing = seen_homing || status.has(status::kHoming);
    const bool told = link_->notices().homed || seen_homing;  // not the bit of an earlier homing
    if (told && status.has(status::kHomed) && !status.has(status::kInMotion)) {
      if (!settled_at_) settled_at_ = clock_.now() + setup_.settle;
      if (clock_.now() >= *settled_at_ && distance_deg(status, 0) <= model_.in_position_deg) break;
    } else {
      settled_at_.reset();
    }
    status.bits &= ~status::kLimits;
    require_no_alarm(status);
    if (clock_.now() >= deadline) {
      throw DeviceError(DeviceErrc::Timeout, name(),
                        fmt::format("not home within {} ms (status: {})", timeout.count(),
                                    describe_status(status.bits)));
    }
    pause();
  }
  settled_at_.reset();
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
