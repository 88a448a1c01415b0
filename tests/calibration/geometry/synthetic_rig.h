#pragma once

#include <vector>

#include "gauge.h"
#include "gonio/calibration/geometry/stage_axes.h"
#include "gonio/rig/kinematics.h"
#include "synthetic_board.h"

namespace gonio::calibration::geometry::test {

/// A rig of metal: built a little off everywhere, in a world that is nobody's gauge.
struct HiddenRig {
  rig::RigDescription rig;
  instrument::CameraModel camera;
  Eigen::Isometry3d sample_from_board;  ///< board's face: x right, y down, z inwards
};

inline rig::ChainLink misaligned(const rig::ChainLink& link, random::Stream& stream) {
  rig::ChainLink result = link;
  result.direction = turn(uniform_vector(stream, 0.3)) * link.direction;
  result.point_mm = link.point_mm + uniform_vector(stream, 0.5);
  result.offset = link.offset + Angle::from_degrees(uniform(stream, 0.5));
  return result;
}

inline Eigen::Isometry3d misplaced(const Eigen::Isometry3d& pose, random::Stream& stream,
                                   double half_range_mm) {
  Eigen::Isometry3d result = pose;
  result.linear() = turn(uniform_vector(stream, 0.3)) * pose.linear();
  result.translation() += uniform_vector(stream, half_range_mm);
  return result;
}

inline HiddenRig hidden_rig(std::uint64_t seed, Scale scale) {
  random::Stream stream(random::make_key(seed, "hidden rig"));
  HiddenRig hidden;
  hidden.rig = rig::la2();
  for (rig::Chain* chain : {&hidden.rig.lamp, &hidden.rig.sample}) {
    for (rig::ChainLink& link : chain->links) link = misaligned(link, stream);
  }
  hidden.rig.camera.home_pose = misplaced(hidden.rig.camera.home_pose, stream, 0.5);
  hidden.rig.lamp.home_pose = misplaced(hidden.rig.lamp.home_pose, stream, 2.0);
  hidden.rig.sample.home_pose = misplaced(hidden.rig.sample.home_pose, stream, 0.5);
  hidden.camera = hidden_camera(stream, scale);
  Eigen::Isometry3d face = Eigen::Isometry3d::Identity();
  face.linear() = turn({180.0, 0.0, 0.0}) * turn({0.0, 0.0, uniform(stream, 3.0)});
  face.translation() = Eigen::Vector3d(uniform(stream, 2.0), uniform(stream, 2.0), 1.5);
  hidden.sample_from_board = misplaced(face, stream, 0.1);
  return hidden;
}

inline Eigen::Isometry3d world_from_board(const HiddenRig& hidden, const rig::Joints& joints) {
  return rig::forward(hidden.rig, joints).world_from_sample * hidden.sample_from_board;
}

inline Eigen::Vector3d outward_normal(const HiddenRig& hidden, const rig::Joints& joints) {
  return -world_from_board(hidden, joints).linear().col(2);
}

inline Eigen::Isometry3d gauge_from_hidden(const HiddenRig& hidden) {
  return calibration::test::gauge_from_world(hidden.rig);
}

inline rig::Joints joints_deg(double lamp_arm, double azimuth, double tilt) {
  return {Angle::from_degrees(lamp_arm), Angle::from_degrees(azimuth), Angle::from_degrees(tilt)};
}

/// Readings from which the axes stand `u_joint_deg` off.
inline rig::Joints stood(const rig::Joints& readings, double u_joint_deg, random::Stream& stream) {
  rig::Joints joints = readings;
  for (Angle& joint : joints) joint += Angle::from_degrees(u_joint_deg * stream.normal());
  return joints;
}

/// The specification's grid: azimuth -45..45 in 15, tilt 0..40 in 10.
inline std::vector<StageView> stage_views(const HiddenRig& hidden, std::uint64_t seed,
                                          double noise_px = 0.1, double u_joint_deg = 0.0) {
  random::Stream stream(random::make_key(seed, "stage views"));
  std::vector<StageView> views;
  for (int azimuth = -45; azimuth <= 45; azimuth += 15) {
    for (int tilt = 0; tilt <= 40; tilt += 10) {
      const rig::Joints readings = joints_deg(90.0, azimuth, tilt);
      const rig::Joints joints = stood(readings, u_joint_deg, stream);
      const Eigen::Isometry3d camera_from_board =
          rig::forward(hidden.rig, joints).world_from_camera.inverse() *
          world_from_board(hidden, joints);
      views.push_back({readings, seen_board(hidden.camera, camera_from_board, noise_px, stream)});
    }
  }
  return views;
}

/// What an intrinsics step would say of the camera: near, with an honest covariance.
inline Intrinsics known_camera(const instrument::CameraModel& truth, std::uint64_t seed) {
  random::Stream stream(random::make_key(seed, "known camera"));
  IntrinsicsOptions options;
  options.width_px = truth.width_px;
  options.height_px = truth.height_px;
  std::vector<BoardView> views;
  for (int k = 0; k < 24; ++k) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = turn({uniform(stream, 35.0), uniform(stream, 35.0), uniform(stream, 20.0)});
    const double x = uniform(stream, 35.0);
    const double y = uniform(stream, 25.0);
    pose.translation() = Eigen::Vector3d(x, y, 350.0 + uniform(stream, 50.0));
    views.push_back(seen_board(truth, pose, 0.1, stream));
  }
  return fit_intrinsics(views, options);
}

inline double degrees_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180.0 / 3.14159265358979323846;
}

/// Joints at which a normal stands along x of the world, by Newton: the zeros without any offset.
template <typename Normal>
Eigen::Vector2d zeros_deg(const Normal& normal) {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();
  for (int k = 0; k < 10; ++k) {
    constexpr double kStep = 1e-3;
    const auto miss = [&](double azimuth, double tilt) {
      const Eigen::Vector3d n = normal(joints_deg(90.0, azimuth, tilt));
      return Eigen::Vector2d(n.y(), n.z());
    };
    Eigen::Matrix2d jacobian;
    jacobian << (miss(at[0] + kStep, at[1]) - miss(at[0] - kStep, at[1])) / (2.0 * kStep),
        (miss(at[0], at[1] + kStep) - miss(at[0], at[1] - kStep)) / (2.0 * kStep);
    at -= jacobian.inverse() * miss(at[0], at[1]);
  }
  return at;
}

}  // namespace gonio::calibration::geometry::test
