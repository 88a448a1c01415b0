#include <stdexcept>

#include "gonio/rig/rig_description.h"

namespace gonio::rig {
namespace {

Axis axis(const char* name, double min_deg, double max_deg, double home_deg, double speed,
          double acceleration) {
  Axis result;
  result.name = name;
  result.min = Angle::from_degrees(min_deg);
  result.max = Angle::from_degrees(max_deg);
  result.home = Angle::from_degrees(home_deg);
  result.max_speed_deg_per_s = speed;
  result.acceleration_deg_per_s2 = acceleration;
  return result;
}

ChainLink turn(std::size_t axis_index, const Eigen::Vector3d& direction) {
  ChainLink link;
  link.axis = axis_index;
  link.direction = direction;
  link.point_mm = Eigen::Vector3d::Zero();
  return link;
}

/// A pose with the given tip axes as columns.
Eigen::Isometry3d pose(const Eigen::Vector3d& x, const Eigen::Vector3d& y, const Eigen::Vector3d& z,
                       const Eigen::Vector3d& origin_mm) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() << x, y, z;
  result.translation() = origin_mm;
  return result;
}

}  // namespace

RigDescription la2(double camera_distance_mm, double lamp_distance_mm) {
  if (!(camera_distance_mm > 0.0) || !(lamp_distance_mm > 0.0)) {
    throw std::invalid_argument("la2: distances must be above 0");
  }
  const Eigen::Vector3d x = Eigen::Vector3d::UnitX();
  const Eigen::Vector3d y = Eigen::Vector3d::UnitY();
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();

  RigDescription rig;
  rig.name = "LA-2";
  rig.axes = {axis("lamp_arm", 7.5, 165.0, 90.0, 20.0, 30.0),
              axis("azimuth", -85.0, 85.0, 0.0, 20.0, 40.0),
              axis("tilt", -5.0, 70.0, 0.0, 10.0, 20.0)};
  // Camera and lamp look at the common point, image up = world up.
  rig.camera.home_pose = pose(y, -z, -x, camera_distance_mm * x);
  rig.lamp.links = {turn(0, z)};
  rig.lamp.home_pose = pose(y, -z, -x, lamp_distance_mm * x);
  rig.sample.links = {turn(1, z), turn(2, -y)};
  rig.sample.home_pose = pose(y, z, x, Eigen::Vector3d::Zero());
  return rig;
}

}  // namespace gonio::rig
