#include "gonio/sim/motion_profile.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

namespace gonio::sim {
namespace {

void require_positive(double value, const char* what) {
  if (!(value > 0.0 && std::isfinite(value))) {
    throw std::invalid_argument(std::string(what) + ": must be positive and finite");
  }
}

void require_finite(double value, const char* what) {
  if (!std::isfinite(value)) throw std::invalid_argument(std::string(what) + ": must be finite");
}

}  // namespace

MotionProfile::MotionProfile(std::vector<Phase> phases, double distance)
    : phases_(std::move(phases)), distance_(distance) {
  for (const Phase& phase : phases_) duration_s_ += phase.duration_s;
}

MotionProfile MotionProfile::rest_to_rest(double distance, double max_speed, double acceleration) {
  require_finite(distance, "distance");
  require_positive(max_speed, "max_speed");
  require_positive(acceleration, "acceleration");
  if (distance == 0.0) return MotionProfile({}, 0.0);

  const double way = std::abs(distance);
  const double sign = distance < 0.0 ? -1.0 : 1.0;
  const double top_speed = std::min(max_speed, std::sqrt(way * acceleration));
  const double ramp_s = top_speed / acceleration;
  const double cruise_s = std::max(0.0, way / top_speed - ramp_s);
  return MotionProfile({{ramp_s, 0.0, sign * acceleration},
                        {cruise_s, sign * top_speed, 0.0},
                        {ramp_s, sign * top_speed, -sign * acceleration}},
                       distance);
}

MotionProfile MotionProfile::braking(double speed, double acceleration) {
  require_finite(speed, "speed");
  require_positive(acceleration, "acceleration");
  if (speed == 0.0) return MotionProfile({}, 0.0);
  const double sign = speed < 0.0 ? -1.0 : 1.0;
  return MotionProfile({{std::abs(speed) / acceleration, speed, -sign * acceleration}},
                       sign * speed * speed / (2.0 * acceleration));
}

double MotionProfile::position(double time_s) const {
  if (time_s <= 0.0) return 0.0;
  if (time_s >= duration_s_) return distance_;
  double way = 0.0;
  for (const Phase& phase : phases_) {
    const double in_phase = std::min(time_s, phase.duration_s);
    way += in_phase * (phase.start_speed + 0.5 * phase.acceleration * in_phase);
    time_s -= in_phase;
  }
  return way;
}

double MotionProfile::speed(double time_s) const {
  if (time_s <= 0.0 || time_s >= duration_s_) return 0.0;
  for (const Phase& phase : phases_) {
    if (time_s < phase.duration_s) return phase.start_speed + phase.acceleration * time_s;
    time_s -= phase.duration_s;
  }
  return 0.0;
}

}  // namespace gonio::sim
