#include "gonio/sim/joint.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gonio/random/distributions.h"

namespace gonio::sim {
namespace {

constexpr std::size_t kRememberedSegments = 16;
/// Of a search for the home mark: how far it goes back before it goes to the mark slowly.
constexpr Angle kBackOff = Angle::from_degrees(0.1);

devices::Clock::Duration from_seconds(double value) {
  return devices::Clock::Duration(std::llround(value * 1e9));
}

}  // namespace

Joint::Joint(const rig::Axis& axis, const AxisOptions& options, std::uint64_t seed,
             std::size_t index, std::uint64_t power_ups)
    : options_(options),
      home_(axis.home),
      limit_{axis.max_speed_deg_per_s, axis.acceleration_deg_per_s2},
      acceleration_rad_per_s2_(Angle::from_degrees(axis.acceleration_deg_per_s2).radians()),
      settle_(axis.settle),
      positioning_key_(random::make_key(seed, "axis.positioning", index)),
      homing_key_(random::make_key(seed, "axis.homing", index)),
      homings_(power_ups << 32U) {
  const double share = random::uniform(random::make_key(seed, "axis.power_up", index), power_ups);
  const double start =
      options.stands_at.value_or(axis.min + share * (axis.max - axis.min)).radians();
  segments_.push_back({Time(0), start, start, MotionProfile::braking(0.0, 1.0), start, Time(0),
                       Time(0), Time(0), 0.0});
}

void Joint::count_noise_from(std::uint64_t index) {
  const std::lock_guard lock(mutex_);
  moves_ = index;
}

Joint::Time Joint::move_to(Angle target, Time now, std::optional<Pace> pace) {
  const std::lock_guard lock(mutex_);
  if (held_ == target) return segments_.back().settled;
  const double error =
      options_.positioning_sigma.radians() * random::normal(positioning_key_, moves_++);
  held_ = target;
  mark_off_rad_.reset();
  return drive_to(target.radians() + error, now, Time(0), limited(pace));
}

Joint::Pace Joint::limited(const std::optional<Pace>& pace) const {
  if (!pace) return limit_;
  return {std::min(pace->max_speed_deg_per_s, limit_.max_speed_deg_per_s),
          std::min(pace->acceleration_deg_per_s2, limit_.acceleration_deg_per_s2)};
}

Joint::Time Joint::start_homing(Time now, std::optional<Angle> mark, std::optional<Pace> pace) {
  const std::lock_guard lock(mutex_);
  held_.reset();
  before_homing_rad_ = state_at(now).motor_rad + slip_rad(now) + homing_error_rad_;
  const double next_error_rad =
      options_.homing_sigma.radians() * random::normal(homing_key_, homings_);
  mark_off_rad_ = next_error_rad - homing_error_rad_ - slip_rad(now);
  slip_found_ = slip_found_ || now >= options_.slips_at;
  lost_rad_ = 0.0;
  return drive_to(mark.value_or(home_).radians(), now, options_.index_search, limited(pace));
}

void Joint::forget_homing() {
  const std::lock_guard lock(mutex_);
  stood_before_home_.reset();
}

void Joint::lose_steps(Angle by) {
  const std::lock_guard lock(mutex_);
  lost_rad_ += by.radians();
}

void Joint::finish_homing() {
  const std::lock_guard lock(mutex_);
  mark_off_rad_.reset();
  homing_error_rad_ = options_.homing_sigma.radians() * random::normal(homing_key_, homings_++);
  held_ = home_;
  stood_before_home_ = Angle::from_radians(before_homing_rad_ - homing_error_rad_);
}

std::optional<Angle> Joint::stood_before_home() const {
  const std::lock_guard lock(mutex_);
  return stood_before_home_;
}

double Joint::slip_rad(Time time) const {
  const double slip = slip_found_ || time < options_.slips_at ? 0.0 : options_.slip.radians();
  return slip + lost_rad_;
}

void Joint::brake(Time now) {
  const std::lock_guard lock(mutex_);
  mark_off_rad_.reset();
  brake_locked(now);
}

void Joint::brake_locked(Time now) {
  if (now >= segments_.back().settled) return;
  held_.reset();
  // A brake asked for during the braking that precedes a new move cancels the move.
  while (segments_.size() > 1 && segments_.back().start > now) segments_.pop_back();
  const State state = state_at(now);
  const auto braking = MotionProfile::braking(state.speed_rad_per_s, acceleration_rad_per_s2_);
  append(braking, state.motor_rad + braking.distance(), now, Time(0), Time(0), false);
}

Joint::Time Joint::drive_to(double motor_rad, Time now, Time search, const Pace& pace) {
  brake_locked(now);
  const Time start = std::max(now, segments_.back().settled);
  const double distance = motor_rad - state_at(start).motor_rad;
  const double speed = Angle::from_degrees(pace.max_speed_deg_per_s).radians();
  const double acceleration = Angle::from_degrees(pace.acceleration_deg_per_s2).radians();
  append(MotionProfile::rest_to_rest(distance, speed, acceleration), motor_rad, start, search,
         settle_, true);
  return segments_.back().settled;
}

void Joint::append(const MotionProfile& profile, double end_rad, Time start, Time search,
                   Time settle, bool rings) {
  const State state = state_at(start);
  const double ring =
      rings ? std::copysign(std::min(options_.ring_fraction * std::abs(profile.distance()),
                                     options_.ring_limit.radians()),
                            profile.distance())
            : 0.0;
  const Time end = start + from_seconds(profile.duration_s());
  Segment& replaced = segments_.back();
  replaced.settled = std::min(replaced.settled, start);
  replaced.arrived = std::min(replaced.arrived, start);
  segments_.push_back({start, state.motor_rad, state.shaft_rad, profile, end_rad, end, end + search,
                       end + search + settle, ring});
  if (segments_.size() > kRememberedSegments) segments_.pop_front();
}

Joint::Time Joint::arrived_at() const {
  const std::lock_guard lock(mutex_);
  return segments_.back().arrived;
}

Joint::Time Joint::settled_at() const {
  const std::lock_guard lock(mutex_);
  return segments_.back().settled;
}

bool Joint::at_rest_during(Time from, Time to) const {
  const std::lock_guard lock(mutex_);
  return std::none_of(segments_.begin(), segments_.end(), [&](const Segment& segment) {
    return segment.start < to && segment.settled > from;
  });
}

Angle Joint::encoder(Time time) const {
  const std::lock_guard lock(mutex_);
  const State state = state_at(time);
  return in_encoder_steps(state.motor_rad + state.ring_rad);
}

Angle Joint::in_encoder_steps(double angle_rad) const {
  const double step = options_.encoder_step.radians();
  return Angle::from_radians(step > 0.0 ? std::round(angle_rad / step) * step : angle_rad);
}

Angle Joint::counter(Time time) const {
  const std::lock_guard lock(mutex_);
  const State state = state_at(time);
  const Segment& last = segments_.back();
  double searched_rad = 0.0;
  if (mark_off_rad_ && time >= last.end && last.arrived > last.end) {
    const double share = std::min(
        1.0, devices::to_seconds(time - last.end) / devices::to_seconds(last.arrived - last.end));
    const double back_rad = -kBackOff.radians();
    searched_rad = share < 0.5 ? 2.0 * share * back_rad
                               : back_rad + (2.0 * share - 1.0) * (*mark_off_rad_ - back_rad);
  }
  return in_encoder_steps(state.motor_rad + state.ring_rad + searched_rad);
}

Angle Joint::true_angle(Time time) const {
  const std::lock_guard lock(mutex_);
  const State state = state_at(time);
  const double shaft = state.shaft_rad + state.ring_rad;
  return Angle::from_radians(shaft + homing_error_rad_ + slip_rad(time)) + options_.zero_offset +
         options_.eccentricity_cos * std::cos(shaft) + options_.eccentricity_sin * std::sin(shaft);
}

const Joint::Segment& Joint::segment_at(Time time) const {
  for (auto segment = segments_.rbegin(); segment != segments_.rend(); ++segment) {
    if (segment->start <= time) return *segment;
  }
  return segments_.front();
}

Joint::State Joint::state_at(Time time) const {
  const Segment& segment = segment_at(time);
  const double since_start = devices::to_seconds(time - segment.start);
  State state{};
  // Past the end the whole way is taken: its time was rounded to a nanosecond, and a sum of start
  // and way would tell in its last bit where the motor came from.
  const bool arrived = time >= segment.end;
  state.motor_rad =
      arrived ? segment.end_rad : segment.motor_rad + segment.profile.position(since_start);
  state.speed_rad_per_s = arrived ? 0.0 : segment.profile.speed(since_start);
  const double half_play = 0.5 * options_.backlash.radians();
  // Exact because the motor never turns round within a segment.
  state.shaft_rad =
      std::clamp(segment.shaft_rad, state.motor_rad - half_play, state.motor_rad + half_play);
  if (arrived && time < segment.settled) {
    const double since_end = devices::to_seconds(time - segment.end);
    state.ring_rad = segment.ring_rad *
                     std::exp(-since_end / devices::to_seconds(Time(options_.ring_decay))) *
                     std::sin(2.0 * std::numbers::pi * options_.ring_hz * since_end);
  }
  return state;
}

}  // namespace gonio::sim
