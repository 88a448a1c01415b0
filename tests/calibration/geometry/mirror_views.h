#pragma once

#include <vector>

#include "gonio/calibration/geometry/lamp_arm.h"
#include "synthetic_rig.h"

namespace gonio::calibration::geometry::test {

constexpr double kMirrorOffset_mm = 2.0;

/// A mirror that lies on the board's plane, raised, and tilted in its mount.
struct HiddenMirror {
  double offset_mm;
  Eigen::Vector3d tilt_deg;  // in the board's plane
};

inline HiddenMirror hidden_mirror(std::uint64_t seed, const MirrorMount& mount) {
  random::Stream stream(random::make_key(seed, "mirror"));
  const double offset = mount.offset_mm + mount.u_offset_mm * stream.normal();
  const double x = mount.u_tilt.degrees() * stream.normal();
  const double y = mount.u_tilt.degrees() * stream.normal();
  return {offset, {x, y, 0.0}};
}

/// Arm 20 to 160 deg, `tilts` mirror poses near the bisector at each; those of which the lamp's
/// image falls into the picture.
inline std::vector<MirrorView> mirror_views(const HiddenRig& hidden, const HiddenMirror& mirror,
                                            std::uint64_t seed, bool both_ways,
                                            double noise_px = 0.1, double u_joint_deg = 0.002) {
  random::Stream stream(random::make_key(seed, "mirror views"));
  std::vector<MirrorView> views;
  for (int arm = 20; arm <= 160; arm += 10) {
    for (int k = 0; k < 8; ++k) {
      const rig::Joints readings =
          joints_deg(arm, 0.5 * arm + uniform(stream, 3.0), uniform(stream, 2.5));
      const rig::Joints joints = stood(readings, u_joint_deg, stream);
      const bool turned = both_ways && k % 2 == 1;
      const Eigen::Isometry3d board = world_from_board(hidden, joints);
      const Eigen::Vector3d inwards =
          board.linear() * turn(turned ? Eigen::Vector3d(-mirror.tilt_deg) : mirror.tilt_deg) *
          Eigen::Vector3d::UnitZ();
      const Eigen::Vector3d point = board * Eigen::Vector3d(0.0, 0.0, -mirror.offset_mm);
      const auto pose = rig::forward(hidden.rig, joints);
      const Eigen::Vector3d lamp = pose.world_from_lamp.translation();
      const Eigen::Vector3d image = lamp - 2.0 * inwards.dot(lamp - point) * inwards;
      Eigen::Vector2d pixel = hidden.camera.project(pose.world_from_camera.inverse() * image);
      pixel.x() += noise_px * stream.normal();
      pixel.y() += noise_px * stream.normal();
      const bool inside = pixel.x() > 0.0 && pixel.y() > 0.0 &&
                          pixel.x() < hidden.camera.width_px && pixel.y() < hidden.camera.height_px;
      if (inside) views.push_back({readings, pixel, turned});
    }
  }
  return views;
}

inline StageAxes found_stage(const HiddenRig& hidden, std::uint64_t seed,
                             const rig::RigDescription& nominal = rig::la2()) {
  StageAxesOptions options;
  options.u_joint = Angle::from_degrees(0.002);
  return fit_stage_axes(nominal, known_camera(hidden.camera, seed),
                        stage_views(hidden, seed, 0.1, 0.002), options);
}

inline LampArmOptions with_jitter() {
  LampArmOptions options;
  options.u_joint = Angle::from_degrees(0.002);
  return options;
}

inline MirrorMount usual_mount() {
  MirrorMount mount;
  mount.offset_mm = kMirrorOffset_mm;
  return mount;
}

}  // namespace gonio::calibration::geometry::test
