#pragma once

#include <Eigen/Geometry>

#include "gonio/rig/kinematics.h"
#include "gonio/sim/sim_options.h"

namespace gonio::sim {

/// The lamp as a polished plane shows it: a disc behind the plane. All in the target's frame, mm.
class LampImage {
 public:
  LampImage(const rig::RigPose& pose, const Eigen::Isometry3d& target_from_world,
            const LampOptions& lamp, const CameraOptions& camera);

  /// Whether the ray that comes from `point` along `ray` (from the camera, of any length) is that
  /// of a place on the disc.
  bool seen(const Eigen::Vector3d& point, const Eigen::Vector3d& ray) const;

  /// Share of the lamp's radiance that comes along `ray` (unit, from the camera) by the polish of
  /// the plane at `point`: 0 where the reflected ray passes the disc by.
  double reflected(const Eigen::Vector3d& point, const Eigen::Vector3d& ray,
                   const PolishedOptions& polish, bool fresnel) const;

  /// Radiance of the disc in W m^-2 sr^-1 for 1 W/sr along its axis.
  double radiance() const { return radiance_; }

 private:
  Eigen::Vector3d lamp_;                 ///< its place
  Eigen::Matrix3d into_lamp_;            ///< turns the target's axes into the lamp's
  Eigen::Vector3d lamp_polarisation_;    ///< unit, target's frame
  Eigen::Vector3d camera_polarisation_;  ///< unit, target's frame
  double lamp_degree_;
  double camera_degree_;
  double radius_mm_;
  double radiance_;
};

}  // namespace gonio::sim
