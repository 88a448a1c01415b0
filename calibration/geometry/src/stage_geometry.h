#pragma once

#include "gonio/calibration/geometry/stage_axes.h"

namespace gonio::calibration::geometry {

/// The unknowns of the stage in their gauge, light enough for the inside of a search.
struct StageGeometry {
  Eigen::Isometry3d world_from_camera;  ///< centre in the plane y = 0
  Eigen::Vector3d tilt_direction;       ///< unit, in the sense of the nominal link
  double skew_mm = 0.0;                 ///< tilt axis from z, along z cross tilt_direction
  Eigen::Isometry3d world_from_board;   ///< at joint zero; the board's normal along x
  double azimuth_offset = 0.0;          ///< rad, about +z
  double tilt_offset = 0.0;             ///< rad, about tilt_direction
  double azimuth_scale = 1.0;           ///< turn about +z per joint angle
  double tilt_scale = 1.0;
  std::size_t azimuth_axis = 0;  ///< indices into RigDescription::axes
  std::size_t tilt_axis = 0;
  Eccentricity azimuth_eccentricity;
  Eccentricity tilt_eccentricity;
  instrument::CameraModel camera;

  /// `jitter` (azimuth, tilt; rad) is added to the joints.
  Eigen::Isometry3d camera_from_board(const rig::Joints& readings,
                                      const Eigen::Vector2d& jitter) const;
  Eigen::Vector3d tilt_point() const;
  /// With errors in the order of stage_parameter added.
  StageGeometry changed_by(const Eigen::VectorXd& errors) const;
};

/// Throws StepRefused, beginning with `step`, unless the rig is an LA-2 about its own z.
void require_la2(const std::string& step, const rig::RigDescription& rig);
/// Throws StepRefused, beginning with `step` and `what`, unless there is one finite joint per axis.
void check_joints(const std::string& step, const std::string& what, const rig::RigDescription& rig,
                  const rig::Joints& joints);

StageGeometry geometry_of(const StageAxes& stage);
/// Puts rig, camera, mount and eccentricities of `geometry` into `stage`, whose rig gives the rest.
void store(const StageGeometry& geometry, StageAxes& stage);

/// Steps for numeric derivatives by the errors of stage_parameter.
Eigen::VectorXd stage_steps();

/// Where the link's joint stands at a reading.
Angle corrected_joint(Angle reading, const Eccentricity& eccentricity);

/// Turn of `angle` rad about an axis.
Eigen::Isometry3d turn_about(const Eigen::Vector3d& direction, const Eigen::Vector3d& point,
                             double angle);

/// The smallest rotation that takes one unit vector to another.
Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

}  // namespace gonio::calibration::geometry
