#include "la2_layout.h"

#include <cmath>
#include <numbers>

#include "tolerance.h"

namespace gonio::rig {
namespace {

/// Angle between two unit vectors, or between their lines.
Angle between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return Angle::from_radians(std::atan2(a.cross(b).norm(), a.dot(b)));
}
Angle between_lines(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return Angle::from_radians(std::atan2(a.cross(b).norm(), std::abs(a.dot(b))));
}

/// Distance of the origin from the link's axis.
double distance_from_origin(const ChainLink& link) {
  return link.point_mm.cross(link.direction).norm();
}

/// Distance of a point from the half line along +x; infinite behind the origin.
double distance_from_x(const Eigen::Vector3d& point) {
  return point.x() > 0.0 ? std::hypot(point.y(), point.z()) : HUGE_VAL;
}

}  // namespace

La2Layout::Part La2Layout::part(const RigDescription& rig, const ChainLink& link,
                                const Eigen::Vector3d& nominal_direction) {
  const double sign = link.direction.dot(nominal_direction) < 0.0 ? -1.0 : 1.0;
  const Axis& axis = rig.axes[link.axis];
  return {link.axis, sign * link.scale, sign * link.offset, axis.min, axis.max};
}

std::optional<La2Layout> La2Layout::of(const RigDescription& rig, Angle angle_tolerance,
                                       double length_tolerance_mm) {
  const auto& sample_links = rig.sample.links;
  const bool structure = rig.camera.links.empty() && rig.lamp.links.size() == 1 &&
                         (sample_links.size() == 2 || sample_links.size() == 3);
  if (!structure) return std::nullopt;
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d minus_y = -Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d normal = rig.sample.home_pose.linear().col(2);
  const ChainLink& lamp = rig.lamp.links[0];

  const auto turns_about = [&](const ChainLink& link, const Eigen::Vector3d& direction) {
    return link.lead_mm_per_turn == 0.0 &&
           between_lines(link.direction, direction) <= angle_tolerance &&
           distance_from_origin(link) <= length_tolerance_mm;
  };
  bool fits = turns_about(lamp, z) && turns_about(sample_links[0], z) &&
              turns_about(sample_links[1], minus_y) && between(normal, x) <= angle_tolerance &&
              rig.sample.home_pose.translation().norm() <= length_tolerance_mm &&
              distance_from_x(rig.camera.home_pose.translation()) <= length_tolerance_mm;
  if (sample_links.size() == 3) fits = fits && turns_about(sample_links[2], x);
  if (rig.collimated_lamp) {
    fits = fits && between(rig.lamp.home_pose.linear().col(2), -x) <= angle_tolerance;
  } else {
    fits = fits && distance_from_x(rig.lamp.home_pose.translation()) <= length_tolerance_mm;
  }
  const bool separate = lamp.axis != sample_links[0].axis && lamp.axis != sample_links[1].axis &&
                        sample_links[0].axis != sample_links[1].axis;
  const bool spin_separate =
      sample_links.size() == 2 ||
      (sample_links[2].axis != lamp.axis && sample_links[2].axis != sample_links[0].axis &&
       sample_links[2].axis != sample_links[1].axis);
  if (!fits || !separate || !spin_separate) return std::nullopt;

  La2Layout layout;
  layout.lamp_ = part(rig, lamp, z);
  layout.azimuth_ = part(rig, sample_links[0], z);
  layout.tilt_ = part(rig, sample_links[1], minus_y);
  layout.home_ = rig.home();
  return layout;
}

Angle La2Layout::joint(const Part& part, Angle link_angle) {
  const Angle joint = (link_angle - part.offset) / part.scale;
  const auto allowed = [&](Angle angle) {
    return angle >= part.min - kAngleTolerance && angle <= part.max + kAngleTolerance;
  };
  if (allowed(joint)) return joint;
  const Angle turn = Angle::from_radians(2.0 * std::numbers::pi / std::abs(part.scale));
  for (const double turns : {-1.0, 1.0}) {
    if (allowed(joint + turn * turns)) return joint + turn * turns;
  }
  return joint;
}

Joints La2Layout::joints_for(const brdf::HalfDiff& direction, Branch branch) const {
  const double side = branch == Branch::B || branch == Branch::D ? -1.0 : 1.0;
  // Exchanging light and detector adds half a turn to phi_d, which flips both components.
  const double exchange = branch == Branch::C || branch == Branch::D ? -1.0 : 1.0;
  const double along = exchange * sin(direction.theta_h) * cos(direction.phi_d);
  const double across = exchange * sin(direction.theta_h) * sin(direction.phi_d);
  const double up = cos(direction.theta_h);
  // atan2 instead of asin and acos, which lose half the digits near the poles.
  const Angle eta = Angle::from_radians(std::atan2(along, up));
  const Angle elevation = Angle::from_radians(std::atan2(across, std::hypot(along, up)));

  Joints joints = home_;
  joints[lamp_.axis] = joint(lamp_, side * 2.0 * direction.theta_d);
  joints[azimuth_.axis] = joint(azimuth_, side * (direction.theta_d - eta));
  joints[tilt_.axis] = joint(tilt_, side * elevation);
  return joints;
}

}  // namespace gonio::rig
