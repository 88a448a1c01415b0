#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <optional>

#include "gonio/devices/clock.h"
#include "gonio/random/key.h"
#include "gonio/rig/rig_description.h"
#include "gonio/sim/motion_profile.h"
#include "gonio/sim/sim_options.h"

namespace gonio::sim {

/// The mechanics of one axis: where motor and shaft are at any time, whatever the stage's state
/// machine thinks about it.
///
/// The motor follows closed-form profiles. The shaft follows the motor with play. After an arrival
/// both ring for the axis's settling time, then stand exactly still.
///
/// Threads  All members from any thread.
class Joint {
 public:
  using Time = devices::Clock::Duration;

  /// Stands somewhere within the limits, as after power-up; `power_ups` as in SimOptions.
  Joint(const rig::Axis& axis, const AxisOptions& options, std::uint64_t seed, std::size_t index,
        std::uint64_t power_ups = 0);

  /// Where the next moves end is drawn from this index on: SimGoniometer::begin_subject().
  void count_noise_from(std::uint64_t index);

  /// How a drive was told to travel.
  struct Pace {
    double max_speed_deg_per_s;
    double acceleration_deg_per_s2;
  };

  /// Starts a move; one under way is braked first. Returns when it will have settled. A target
  /// that is already held costs nothing. The axis's own pace is its limit.
  Time move_to(Angle target, Time now, std::optional<Pace> pace = std::nullopt);

  /// Drives to the home mark and searches it. finish_homing() redefines the zero at its end.
  /// `mark`: the same one whole turns from home. The axis's own pace is the limit.
  Time start_homing(Time now, std::optional<Angle> mark = std::nullopt,
                    std::optional<Pace> pace = std::nullopt);
  void finish_homing();
  /// What the last homing found is old: another begins.
  void forget_homing();
  /// Where it stood when the last homing began, by the zero that it found. Nothing before the first
  /// and after one that did not finish.
  std::optional<Angle> stood_before_home() const;

  void brake(Time now);

  /// Turns the shaft without its encoder knowing, until the next homing.
  void lose_steps(Angle by);

  /// When the motor will have done what it was sent for, or had: a homing's search included,
  /// ringing not.
  Time arrived_at() const;
  /// When the axis will stand still, or stood still if that is past.
  Time settled_at() const;
  bool at_rest_during(Time from, Time to) const;

  Angle encoder(Time time) const;
  /// What a counter shows that goes on in its old zero until finish_homing(): as encoder(), and
  /// while the mark is searched back from where it was believed, then slowly to where it is.
  Angle counter(Time time) const;
  Angle true_angle(Time time) const;

 private:
  struct Segment {
    Time start;
    double motor_rad;  ///< at the start
    double shaft_rad;
    MotionProfile profile;
    double end_rad;  ///< of the motor: where it was sent, to the last bit, from wherever it came
    Time end;
    Time arrived;
    Time settled;
    double ring_rad;  ///< amplitude
  };
  struct State {
    double motor_rad;
    double shaft_rad;
    double speed_rad_per_s;
    double ring_rad;
  };

  const Segment& segment_at(Time time) const;
  State state_at(Time time) const;
  Angle in_encoder_steps(double angle_rad) const;
  Pace limited(const std::optional<Pace>& pace) const;
  double slip_rad(Time time) const;
  void append(const MotionProfile& profile, double end_rad, Time start, Time search, Time settle,
              bool rings);
  void brake_locked(Time now);
  Time drive_to(double motor_rad, Time now, Time search, const Pace& pace);

  mutable std::mutex mutex_;
  AxisOptions options_;
  Angle home_;
  Pace limit_;
  double acceleration_rad_per_s2_;  ///< of braking
  Time settle_;
  random::Key positioning_key_;
  random::Key homing_key_;
  std::deque<Segment> segments_;  ///< the last few: an exposure may reach back over a stop
  std::optional<Angle> held_;     ///< the target the axis stands at or travels to
  std::uint64_t moves_ = 0;
  std::uint64_t homings_ = 0;
  double homing_error_rad_ = 0.0;
  bool slip_found_ = false;         ///< by the homing under way, or one before
  double before_homing_rad_ = 0.0;  ///< of the homing under way, true but for zero_offset
  double lost_rad_ = 0.0;           ///< since the last homing
  /// Of the homing under way: the mark in the encoder's old count, less where it was believed.
  std::optional<double> mark_off_rad_;
  std::optional<Angle> stood_before_home_;
};

}  // namespace gonio::sim
