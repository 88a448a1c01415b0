#include <cmath>

#include "gonio/calibration/geometry/stage_axes.h"
#include "gonio/rig/kinematics.h"
#include "propagate.h"
#include "stage_geometry.h"

namespace gonio::calibration::geometry {
namespace {

double angle_between_axes(const StageAxes& stage) {
  const Eigen::Vector3d& tilt = stage.rig.sample.links[1].direction;
  return std::atan2(std::hypot(tilt.x(), tilt.y()), tilt.z());
}

Eigen::Vector3d ray_of(const StageAxes& stage, const Eigen::Vector2d& pixel) {
  return stage.rig.camera.home_pose.linear() * stage.camera.ray(pixel.x(), pixel.y());
}

Eigen::Vector3d normal_of(const StageAxes& stage, const rig::Joints& readings) {
  return rig::forward(stage.rig, corrected(stage, readings)).world_from_sample.linear().col(2);
}

template <typename Quantity>
Eigen::MatrixXd covariance_of(const StageAxes& stage, const Quantity& quantity) {
  return propagated(
      [&](const Eigen::VectorXd& errors) { return quantity(perturbed(stage, errors)); },
      stage.covariance, stage_steps());
}

Eigen::VectorXd one(double value) { return Eigen::VectorXd::Constant(1, value); }

}  // namespace

Angle DirectionEstimate::sigma() const {
  return Angle::from_radians(std::sqrt(0.5 * covariance.trace()));
}

rig::Joints corrected(const StageAxes& stage, const rig::Joints& readings) {
  rig::Joints joints = readings;
  const std::size_t azimuth = stage.rig.sample.links.at(0).axis;
  const std::size_t tilt = stage.rig.sample.links.at(1).axis;
  joints.at(azimuth) = corrected_joint(readings.at(azimuth), stage.azimuth_eccentricity);
  joints.at(tilt) = corrected_joint(readings.at(tilt), stage.tilt_eccentricity);
  return joints;
}

StageAxes perturbed(const StageAxes& stage, const Eigen::VectorXd& errors) {
  StageAxes result = stage;
  store(geometry_of(stage).changed_by(errors), result);
  return result;
}

StageAxes on_its_datum(const StageAxes& one, const StageAxes& turned) {
  namespace at = stage_parameter;
  const StageGeometry from = geometry_of(one);
  const StageGeometry to = geometry_of(turned);
  const auto heading = [](const Eigen::Vector3d& direction) {
    return std::atan2(direction.y(), direction.x());
  };
  Eigen::VectorXd errors = Eigen::VectorXd::Zero(at::kCount);
  errors[at::kAzimuthOffset] = 0.5 * (to.azimuth_offset - from.azimuth_offset);
  errors[at::kTiltOffset] = 0.5 * (to.tilt_offset - from.tilt_offset);
  // Turned back as the azimuth's zero turns it, or a tilted sample would seem to face aside.
  errors[at::kTiltAxisHeading] = 0.5 * (heading(to.tilt_direction) - heading(from.tilt_direction));
  // The covariance stays that of one: of the mean of two it is no more, and not less in what is
  // common to both, the camera's place say.
  return perturbed(one, errors);
}

AngleEstimate axis_angle(const StageAxes& stage) {
  const auto covariance =
      covariance_of(stage, [](const StageAxes& s) { return one(angle_between_axes(s)); });
  return {Angle::from_radians(angle_between_axes(stage)),
          Angle::from_radians(std::sqrt(covariance(0, 0)))};
}

LengthEstimate axis_skew(const StageAxes& stage) {
  const auto skew = [](const StageAxes& s) { return one(geometry_of(s).skew_mm); };
  return {skew(stage)[0], std::sqrt(covariance_of(stage, skew)(0, 0))};
}

DirectionEstimate pixel_ray(const StageAxes& stage, const Eigen::Vector2d& pixel) {
  const auto ray = [&](const StageAxes& s) { return Eigen::VectorXd(ray_of(s, pixel)); };
  return {ray_of(stage, pixel), covariance_of(stage, ray)};
}

DirectionEstimate board_normal(const StageAxes& stage, const rig::Joints& readings) {
  const auto normal = [&](const StageAxes& s) { return Eigen::VectorXd(normal_of(s, readings)); };
  return {normal_of(stage, readings), covariance_of(stage, normal)};
}

}  // namespace gonio::calibration::geometry
