#include "stage_geometry.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"
#include "plane_pose.h"

namespace gonio::calibration::geometry {
namespace {

const Eigen::Vector3d kX = Eigen::Vector3d::UnitX();
const Eigen::Vector3d kZ = Eigen::Vector3d::UnitZ();

/// The horizontal unit vector across the tilt axis.
Eigen::Vector3d across(const Eigen::Vector3d& tilt_direction) {
  return kZ.cross(tilt_direction).normalized();
}

double upwards(const rig::ChainLink& azimuth) { return azimuth.direction.z() < 0.0 ? -1.0 : 1.0; }

}  // namespace

Angle corrected_joint(Angle reading, const Eccentricity& eccentricity) {
  return reading + cos(reading) * eccentricity.a + sin(reading) * eccentricity.b;
}

Eigen::Isometry3d turn_about(const Eigen::Vector3d& direction, const Eigen::Vector3d& point,
                             double angle) {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = Eigen::AngleAxisd(angle, direction).toRotationMatrix();
  motion.translation() = point - motion.linear() * point;
  return motion;
}

Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to).toRotationMatrix();
}

Eigen::Vector3d StageGeometry::tilt_point() const { return skew_mm * across(tilt_direction); }

Eigen::Isometry3d StageGeometry::camera_from_board(const rig::Joints& readings,
                                                   const Eigen::Vector2d& jitter) const {
  const double azimuth =
      corrected_joint(readings[azimuth_axis], azimuth_eccentricity).radians() + jitter[0];
  const double tilt = corrected_joint(readings[tilt_axis], tilt_eccentricity).radians() + jitter[1];
  return world_from_camera.inverse() *
         turn_about(kZ, Eigen::Vector3d::Zero(), azimuth_scale * azimuth + azimuth_offset) *
         turn_about(tilt_direction, tilt_point(), tilt_scale * tilt + tilt_offset) *
         world_from_board;
}

StageGeometry StageGeometry::changed_by(const Eigen::VectorXd& errors) const {
  namespace at = stage_parameter;
  StageGeometry changed = *this;
  changed.world_from_camera.translation().x() += errors[at::kCameraX];
  changed.world_from_camera.translation().z() += errors[at::kCameraZ];
  changed.world_from_camera.linear() =
      rotation_by(errors.segment<3>(at::kCameraTurn)) * world_from_camera.linear();
  // Raising it towards z is a turn about the horizontal across it.
  const Eigen::Vector3d raise = -errors[at::kAxisAngle] * across(tilt_direction);
  changed.tilt_direction =
      (rotation_by(raise + errors[at::kTiltAxisHeading] * kZ) * tilt_direction).normalized();
  changed.skew_mm += errors[at::kSkew];
  changed.world_from_board.linear() =
      rotation_by(errors[at::kBoardTurn] * kX) * world_from_board.linear();
  changed.world_from_board.translation() += errors.segment<3>(at::kBoardOrigin);
  changed.azimuth_offset += errors[at::kAzimuthOffset];
  changed.tilt_offset += errors[at::kTiltOffset];
  const auto add = [&](Angle& angle, Eigen::Index k) {
    angle += Angle::from_radians(errors[at::kEccentricity + k]);
  };
  add(changed.azimuth_eccentricity.a, 0);
  add(changed.azimuth_eccentricity.b, 1);
  add(changed.tilt_eccentricity.a, 2);
  add(changed.tilt_eccentricity.b, 3);
  changed.camera = changed_camera(camera, errors.segment<kCameraParameters>(at::kCamera));
  return changed;
}

void require_la2(const std::string& step, const rig::RigDescription& rig) {
  const auto& links = rig.sample.links;
  const auto turns = [](const rig::ChainLink& link) { return link.lead_mm_per_turn == 0.0; };
  const bool fits = rig.camera.links.empty() && links.size() == 2 && turns(links[0]) &&
                    turns(links[1]) && links[0].axis != links[1].axis &&
                    std::abs(links[0].direction.z()) > 0.99 &&
                    std::abs(links[1].direction.z()) < 0.3;
  if (fits) return;
  throw StepRefused(
      fmt::format("{}: the rig \"{}\" is no LA-2, expected a fixed camera and a "
                  "sample on azimuth (about z) and tilt: describe it so",
                  step, rig.name));
}

void check_joints(const std::string& step, const std::string& what, const rig::RigDescription& rig,
                  const rig::Joints& joints) {
  if (joints.size() != rig.axes.size()) {
    throw StepRefused(fmt::format("{}: {} has {} joint angles, expected {}, one per axis", step,
                                  what, joints.size(), rig.axes.size()));
  }
  for (std::size_t k = 0; k < joints.size(); ++k) {
    constexpr double kManyTurns_rad = 100.0;
    if (std::abs(joints[k].radians()) < kManyTurns_rad) continue;  // false for not a number
    throw StepRefused(fmt::format("{}: {} has {} at {} deg, expected a finite angle: read it again",
                                  step, what, rig.axes[k].name, joints[k].degrees()));
  }
}

StageGeometry geometry_of(const StageAxes& stage) {
  const rig::ChainLink& azimuth = stage.rig.sample.links.at(0);
  const rig::ChainLink& tilt = stage.rig.sample.links.at(1);
  StageGeometry geometry;
  geometry.world_from_camera = stage.rig.camera.home_pose;
  geometry.tilt_direction = tilt.direction;
  geometry.skew_mm = tilt.point_mm.dot(across(tilt.direction));
  geometry.world_from_board = stage.rig.sample.home_pose * stage.board_from_sample.inverse();
  geometry.azimuth_offset = upwards(azimuth) * azimuth.offset.radians();
  geometry.tilt_offset = tilt.offset.radians();
  geometry.azimuth_scale = upwards(azimuth) * azimuth.scale;
  geometry.tilt_scale = tilt.scale;
  geometry.azimuth_axis = azimuth.axis;
  geometry.tilt_axis = tilt.axis;
  geometry.azimuth_eccentricity = stage.azimuth_eccentricity;
  geometry.tilt_eccentricity = stage.tilt_eccentricity;
  geometry.camera = stage.camera;
  return geometry;
}

void store(const StageGeometry& geometry, StageAxes& stage) {
  rig::RigDescription& rig = stage.rig;
  rig.camera.home_pose = geometry.world_from_camera;
  rig::ChainLink& azimuth = rig.sample.links.at(0);
  const double up = upwards(azimuth);
  azimuth.direction = up * kZ;
  azimuth.point_mm.setZero();
  azimuth.scale = up * geometry.azimuth_scale;
  azimuth.offset = Angle::from_radians(up * geometry.azimuth_offset);
  rig::ChainLink& tilt = rig.sample.links.at(1);
  tilt.direction = geometry.tilt_direction;
  tilt.point_mm = geometry.tilt_point();
  tilt.scale = geometry.tilt_scale;
  tilt.offset = Angle::from_radians(geometry.tilt_offset);

  Eigen::Isometry3d& home = rig.sample.home_pose;
  home.linear() = rotation_between(home.linear().col(2), kX) * home.linear();
  home.translation() = geometry.world_from_board.translation().x() * kX;
  stage.board_from_sample = geometry.world_from_board.inverse() * home;
  stage.azimuth_eccentricity = geometry.azimuth_eccentricity;
  stage.tilt_eccentricity = geometry.tilt_eccentricity;
  stage.camera = geometry.camera;
}

Eigen::VectorXd stage_steps() {
  namespace at = stage_parameter;
  Eigen::VectorXd steps = Eigen::VectorXd::Constant(at::kCount, kAngleStep_rad);
  steps[at::kCameraX] = steps[at::kCameraZ] = steps[at::kSkew] = kLengthStep_mm;
  steps.segment<3>(at::kBoardOrigin).setConstant(kLengthStep_mm);
  steps.segment<kCameraParameters>(at::kCamera) = camera_steps();
  return steps;
}

}  // namespace gonio::calibration::geometry
