#include "gonio/calibration/geometry/sample_plane.h"

#include <cmath>
#include <stdexcept>

#include "gonio/rig/kinematics.h"
#include "propagate.h"
#include "stage_geometry.h"

namespace gonio::calibration::geometry {

SamplePlane sample_plane(const StageAxes& stage, const SampleDatum& datum) {
  if (!std::isfinite(datum.raised_mm) || !(datum.u_raised_mm >= 0.0) ||
      !(datum.u_tilt >= Angle())) {
    throw std::invalid_argument(
        "sample plane: thickness and uncertainties must be finite and >= 0");
  }
  const rig::Joints zero(stage.rig.axes.size());
  const Eigen::Matrix3d axes =
      rig::forward(stage.rig, corrected(stage, zero)).world_from_sample.linear();
  const auto face = [&](const Eigen::VectorXd& errors) -> Eigen::VectorXd {
    const StageAxes changed = perturbed(stage, errors);
    const Eigen::Isometry3d pose =
        rig::forward(changed.rig, corrected(changed, zero)).world_from_sample;
    const Eigen::Vector3d normal = pose.linear().col(2);
    // A turn about x takes z towards -y, one about y towards x.
    return Eigen::Vector3d(-normal.dot(axes.col(1)), normal.dot(axes.col(0)),
                           normal.dot(pose.translation()));
  };
  SamplePlane plane;
  plane.rig = stage.rig;
  plane.rig.sample.home_pose.translation() +=
      datum.raised_mm * stage.rig.sample.home_pose.linear().col(2);
  plane.covariance = propagated(face, stage.covariance, stage_steps());
  const double u_tilt = datum.u_tilt.radians();
  plane.covariance.diagonal() +=
      Eigen::Vector3d(u_tilt * u_tilt, u_tilt * u_tilt, datum.u_raised_mm * datum.u_raised_mm);
  return plane;
}

}  // namespace gonio::calibration::geometry
