#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "gonio/calibration/geometry/estimates.h"
#include "gonio/calibration/geometry/stage_axes.h"
#include "gonio/calibration/result/calibrated_rig.h"

namespace gonio::calibration::geometry {

/// The lamp, seen in a flat first-surface mirror on the cradle.
struct MirrorView {
  rig::Joints joints;     ///< readings, every axis approached from the same side
  Eigen::Vector2d pixel;  ///< centre of the lamp's image
  /// The mirror was turned by half a turn in its mount. A tilt of the mirror in its mount turns the
  /// lamp's direction by twice as much and nearly passes for an error of the arm's zero: views of
  /// one kind tell them apart by the variety of their poses only, views of both kinds much better.
  bool turned = false;
};

/// How the mirror lies where the board lay.
struct MirrorMount {
  double offset_mm = 0.0;  ///< reflecting face from the board's face, outwards
  double u_offset_mm = 0.02;
  Angle u_tilt = Angle::from_degrees(0.05);  ///< about each of two axes in its face, as mounted
};

struct LampArmOptions {
  std::size_t min_views = 20;
  Angle min_arm_span = Angle::from_degrees(60.0);
  double u_pixel = 0.1;  ///< standard deviation of one coordinate of a centre; a start
  /// Standard deviation of where an axis comes to stand about its reading.
  Angle u_joint;
  double max_rms_px = 1.0;  ///< of the centres' distances from the model; above it it refuses
};

/// Order of the errors in LampArm::covariance; after them those of the stage (stage_parameter).
namespace lamp_parameter {
inline constexpr Eigen::Index kAxisTurn = 0;   ///< 2: arm axis turned about world x, y; rad
inline constexpr Eigen::Index kAxisPoint = 2;  ///< 2: where it meets the plane z = 0; x, y, mm
inline constexpr Eigen::Index kLampX = 4;      ///< lamp at arm zero, mm; its y is 0
inline constexpr Eigen::Index kLampZ = 5;
inline constexpr Eigen::Index kOffset = 6;      ///< of the arm, about +z; rad
inline constexpr Eigen::Index kMirrorTilt = 7;  ///< 2: mirror in its mount, about sample x, y; rad
inline constexpr Eigen::Index kMirrorOffset = 9;  ///< of its face from where it was given; mm
inline constexpr Eigen::Index kCount = 10;
}  // namespace lamp_parameter

/// The arm as the mirror has shown it.
struct LampArm {
  /// The stage's rig with the lamp's chain as found: axis, zero (the lamp at arm 0 has the camera's
  /// azimuth), way of counting, the lamp's place. The lamp's own frame, which a mirror does not
  /// show, is turned along with its place.
  rig::RigDescription rig;
  Angle mirror_tilt_x;  ///< of the mirror in its mount, before it was turned
  Angle mirror_tilt_y;
  /// Square, lamp_parameter then stage_parameter: what the stage is uncertain by is in it.
  Eigen::MatrixXd covariance;
  double rms_px = 0.0;                       ///< of the centres' distances from the model
  std::vector<Eigen::Vector2d> residual_px;  ///< per view
  std::vector<std::string> notes;  ///< what a person should know: an arm that counts backwards
};

/// The lamp's circular path from mirror views at many arm angles.
///
/// `stage`    From fit_stage_axes; its rig's lamp chain is nominal, one link about z.
/// Method     The virtual image of the lamp behind the mirror is projected into the camera; seven
///            parameters of the path, two tilts and the offset of the mirror are found together.
///            The stage stays as it is and its covariance is passed on.
/// Threads    Any.
/// Errors     StepRefused: another kind of rig, too few views or arm angles, pixels or joints that
///            are no numbers or not one per axis, mirror poses that cannot show a lamp, an arm that
///            turns at another rate, views that contradict each other.
LampArm fit_lamp_arm(const StageAxes& stage, std::span<const MirrorView> views,
                     const MirrorMount& mount, const LampArmOptions& options = {});

/// Unit vector from the world's origin to the lamp with the arm at `reading`: wi for a sample
/// there.
DirectionEstimate lamp_direction(const LampArm& lamp, Angle reading);
/// The largest standard deviation of it, per axis across it, over the arm's way.
Angle worst_direction_sigma(const LampArm& lamp);

/// Rigs that differ from the one found (`stage` with the lamp's chain of `lamp`) by one standard
/// deviation of an independent error of stage, lens and lamp each. What is found with the whole rig
/// moves with them, and the sum of the squares of how far is its variance.
std::vector<CalibratedRig> one_sigma_rigs(const StageAxes& stage, const LampArm& lamp);
/// Its distance from the world's origin.
LengthEstimate lamp_distance(const LampArm& lamp, Angle reading);

}  // namespace gonio::calibration::geometry
