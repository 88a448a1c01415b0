#include "drive_core.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace gonio::modbus_emulator {

using emulator_faults::Fault;

DriveCore::DriveCore(std::string name, const DriveMechanics& mechanics, Faults faults,
                     bool absolute_encoder)
    : name_(std::move(name)),
      mechanics_(mechanics),
      faults_(std::move(faults)),
      absolute_encoder_(absolute_encoder) {
  if (mechanics_.reversed) mechanics_.steps_per_deg = -mechanics_.steps_per_deg;
  zero_ = mechanics_.joint->encoder(now());
}

void DriveCore::move_to(std::int64_t steps, double steps_per_s, double steps_per_s2) {
  look();
  if (trouble_ != Trouble::none || !(steps_per_s > 0.0) || !(steps_per_s2 > 0.0)) return;
  target_steps_ = steps;
  completed_ = false;
  doing_ = Doing::moving;
  const double per_deg = std::abs(mechanics_.steps_per_deg);
  const sim::Joint::Pace pace{steps_per_s / per_deg, steps_per_s2 / per_deg};
  const Angle target =
      zero_ + Angle::from_degrees(static_cast<double>(steps) / mechanics_.steps_per_deg);
  never_completes_ = strikes(Fault::never_in_position);
  if (!stopped_halfway_by_fault(target, pace)) mechanics_.joint->move_to(target, now(), pace);
}

bool DriveCore::stopped_halfway_by_fault(Angle target, const sim::Joint::Pace& pace) {
  const bool alarm = strikes(Fault::alarm);
  const bool limit = strikes(Fault::limit_switch);
  if (!alarm && !limit) return false;
  coming_ = alarm ? Trouble::alarm : Trouble::limit_switch;
  const Angle here = mechanics_.joint->encoder(now());
  mechanics_.joint->move_to(here + 0.5 * (target - here), now(), pace);
  return true;
}

void DriveCore::home() {
  look();
  if (trouble_ != Trouble::none) return;
  homed_ = false;
  completed_ = false;
  never_completes_ = strikes(Fault::never_in_position);
  if (strikes(Fault::alarm)) {
    trouble_ = Trouble::alarm;
    return;
  }
  doing_ = Doing::homing;
  if (faults_) {
    mechanics_.joint->lose_steps(Angle::from_degrees(faults_->lost_steps_deg(name_, now())));
  }
  mechanics_.joint->start_homing(now());
}

void DriveCore::stop() {
  look();
  if (doing_ != Doing::nothing && strikes(Fault::stop_ignored)) return;
  mechanics_.joint->brake(now());
  doing_ = Doing::nothing;
  coming_ = Trouble::none;
  target_steps_ = feedback_steps();
}

void DriveCore::reset_alarm() {
  look();
  trouble_ = Trouble::none;
}

void DriveCore::lose_power() {
  mechanics_.joint->brake(now());
  doing_ = Doing::nothing;
  completed_ = false;
  homed_ = false;
  trouble_ = Trouble::none;
  coming_ = Trouble::none;
  if (!absolute_encoder_) zero_ = mechanics_.joint->encoder(now());
  target_steps_ = 0;
}

void DriveCore::look() {
  if (strikes(Fault::power_cycle)) lose_power();
  if (doing_ == Doing::nothing || now() < mechanics_.joint->arrived_at()) return;
  const Doing done = std::exchange(doing_, Doing::nothing);
  if (coming_ != Trouble::none) {
    trouble_ = std::exchange(coming_, Trouble::none);
    return;
  }
  if (never_completes_) return;
  completed_ = true;
  if (done == Doing::homing) {
    mechanics_.joint->finish_homing();
    zero_ = mechanics_.home;
    target_steps_ = 0;
    homed_ = true;
  }
}

std::int32_t DriveCore::feedback_steps() {
  look();
  // An absolute encoder is the home itself: there is no mark to look for.
  const Angle counted =
      absolute_encoder_ ? mechanics_.joint->encoder(now()) : mechanics_.joint->counter(now());
  const double steps = (counted - zero_).degrees() * mechanics_.steps_per_deg;
  constexpr double kLimit = std::numeric_limits<std::int32_t>::max();
  return static_cast<std::int32_t>(std::clamp(std::round(steps), -kLimit, kLimit));
}

bool DriveCore::moving() {
  look();
  return now() < mechanics_.joint->arrived_at();
}

bool DriveCore::completed() {
  look();
  return completed_;
}

bool DriveCore::homed() {
  look();
  return homed_;
}

DriveCore::Trouble DriveCore::trouble() {
  look();
  return trouble_;
}

bool DriveCore::strikes(Fault fault) { return faults_ && faults_->strikes(fault, name_, now()); }

}  // namespace gonio::modbus_emulator
