#pragma once

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "gonio/rig/rig_description.h"

namespace gonio::calibration::test {

/// A calibration's own world from the one a rig is described in, by the gauge's definition
/// (stage_axes.h), from its links and camera.
inline Eigen::Isometry3d gauge_from_world(const rig::RigDescription& rig) {
  const rig::ChainLink& azimuth = rig.sample.links.at(0);
  const rig::ChainLink& tilt = rig.sample.links.at(1);
  const Eigen::Vector3d z = azimuth.direction;
  const Eigen::Vector3d across = z.cross(tilt.direction);
  // azimuth.point + s z + r across = tilt.point + t tilt
  Eigen::Matrix3d lines;
  lines << z, across, -tilt.direction;
  const Eigen::Vector3d s =
      lines.fullPivLu().solve(Eigen::Vector3d(tilt.point_mm - azimuth.point_mm));
  const Eigen::Vector3d origin = azimuth.point_mm + s[0] * z;
  const Eigen::Vector3d to_camera = rig.camera.home_pose.translation() - origin;
  const Eigen::Vector3d x = (to_camera - to_camera.dot(z) * z).normalized();
  Eigen::Isometry3d world_from_gauge = Eigen::Isometry3d::Identity();
  world_from_gauge.linear() << x, z.cross(x), z;
  world_from_gauge.translation() = origin;
  return world_from_gauge.inverse();
}

}  // namespace gonio::calibration::test
