// What AptStage does until its axis knows where it is.

#include <fmt/format.h>

#include <algorithm>

#include "apt_link.h"
#include "gonio/apt_stage/apt_stage.h"

namespace gonio::apt_stage {

using devices::DeviceErrc;
using devices::DeviceError;

void AptStage::home(std::chrono::milliseconds timeout) {
  stood_before_home_.reset();
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
    devices::HomeCount count(before.position);
    if (knows_where) go_before_the_mark(deadline);
    // Elsewhere it may be a turn away. A setting that is lost makes the answer rougher, not wrong.
    if (knows_where && tells()) link_->send(set_home(search_at(kTellingSpeedDegPerS)));
    link_->forget();  // before the hold: stop() waits for that
    {
      const auto hold = gate_.hold_for_homing();
      target_.reset();
      settled_at_.reset();
      link_->send(move_home());
    }
    try {
      wait_for_home(deadline, timeout, count);
    } catch (const DeviceError&) {
      // An axis that does not know where it is must not drive on.
      if (link_->port().connected()) link_->send(move_stop(StopMode::immediate));
      throw;
    }
    if (tells()) note_where_it_stood(count);
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
    // From farther away a search at the speed at which it tells would take minutes.
    const double most_deg = tells() ? 2.0 * run_up_deg : kTurnDeg - run_up_deg;
    const bool is_before = before_deg >= run_up_deg && before_deg <= most_deg;
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

void AptStage::wait_for_home(Time deadline, std::chrono::milliseconds timeout,
                             devices::HomeCount& count) {
  bool seen_homing = false;
  while (true) {
    gate_.require_not_stopped();
    const Time asked = clock_.now();
    StatusUpdate status = confirmed_status();
    // Position and bits are of one message, so of one zero.
    if (status.has(status::kHoming)) {
      seen_homing = true;
      count.searching(status.position, asked);
    } else {
      count.searches_no_more(clock_.now());
    }
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

void AptStage::note_where_it_stood(const devices::HomeCount& count) {
  const auto way = count.way_to_mark();
  if (!way) return;
  double from_home_deg = -direction_ * way->counts / model_.steps_per_deg;
  // A search that began behind the mark came to it by a whole turn.
  constexpr double kTurnDeg = 360.0;
  const double least_deg = (setup_.limits.min - setup_.home).degrees();
  const double most_deg = (setup_.limits.max - setup_.home).degrees();
  while (from_home_deg > most_deg && from_home_deg - kTurnDeg >= least_deg) {
    from_home_deg -= kTurnDeg;
  }
  while (from_home_deg < least_deg && from_home_deg + kTurnDeg <= most_deg) {
    from_home_deg += kTurnDeg;
  }
  stood_before_home_ = {setup_.home + Angle::from_degrees(from_home_deg),
                        Angle::from_degrees(way->within / model_.steps_per_deg)};
}

}  // namespace gonio::apt_stage
