#pragma once

#include <optional>

#include "gonio/rig/kinematics.h"

namespace gonio::rig {

/// Which axes of a rig play the three parts of an LA-2, and how their joints count.
///
/// A spin about the sample's normal, if there is one, and axes outside the chains stay at home.
class La2Layout {
 public:
  /// The layout, if the rig is an LA-2 within the tolerances: fixed camera on +x, lamp on an arm
  /// about z, sample on azimuth (z) and tilt (-y), all axes through the origin.
  static std::optional<La2Layout> of(const RigDescription& rig, Angle angle_tolerance,
                                     double length_tolerance_mm);

  /// Closed-form joints for a direction; wrapped by full turns into the axes' limits where that
  /// helps. Not checked against limits.
  ///
  /// Source   Follows from n = (cos g cos b, cos g sin b, sin g) and the half vector standing at
  ///          alpha/2: rig pages of docs/conventions.md, "LA-2".
  Joints joints_for(const brdf::HalfDiff& direction, Branch branch) const;

 private:
  /// Link angle = scale * joint + offset.
  struct Part {
    std::size_t axis = 0;
    double scale = 1.0;
    Angle offset;
    Angle min, max;
  };
  static Part part(const RigDescription& rig, const ChainLink& link,
                   const Eigen::Vector3d& nominal_direction);
  static Angle joint(const Part& part, Angle link_angle);

  Part lamp_, azimuth_, tilt_;
  Joints home_;
};

}  // namespace gonio::rig
