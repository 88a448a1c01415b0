#pragma once

#include <vector>

namespace gonio::sim {

/// Position over time of one axis along a line of constant-acceleration phases, as a closed
/// formula, so that a camera can ask where the axis was at any moment of an exposure.
///
/// Units    Any unit of angle, used throughout; time in seconds from the start.
/// Threads  Plain value.
class MotionProfile {
 public:
  /// From rest to rest over a signed `distance` with a trapezoid of speed, a triangle when the
  /// distance is too short for `max_speed`. Throws std::invalid_argument unless speed and
  /// acceleration are positive and everything is finite.
  static MotionProfile rest_to_rest(double distance, double max_speed, double acceleration);

  /// From a signed `speed` to rest with a constant deceleration.
  static MotionProfile braking(double speed, double acceleration);

  double duration_s() const { return duration_s_; }
  double distance() const { return distance_; }

  /// Signed way from the start; 0 before it and exactly distance() after the end.
  double position(double time_s) const;
  double speed(double time_s) const;  ///< signed; 0 before the start and after the end

 private:
  struct Phase {
    double duration_s;
    double start_speed;
    double acceleration;
  };

  MotionProfile(std::vector<Phase> phases, double distance);

  std::vector<Phase> phases_;
  double distance_;
  double duration_s_ = 0.0;
};

}  // namespace gonio::sim
