#pragma once

#include <Eigen/Geometry>
#include <array>
#include <span>
#include <string>
#include <vector>

#include "gonio/calibration/geometry/board_view.h"
#include "gonio/calibration/geometry/estimates.h"
#include "gonio/calibration/geometry/intrinsics.h"
#include "gonio/rig/rig_description.h"

namespace gonio::calibration::geometry {

/// The board on the cradle, seen by the fixed camera.
struct StageView {
  /// Readings, one per axis of the rig. Every axis was approached from the same side, so that
  /// backlash is part of the zero.
  rig::Joints joints;
  BoardView board;
};

struct StageAxesOptions {
  std::size_t min_views = 12;
  std::size_t min_corners = 12;                 ///< per view
  Angle max_slant = Angle::from_degrees(45.0);  ///< views slanted more are left out
  Angle min_azimuth_span = Angle::from_degrees(30.0);
  Angle min_tilt_span = Angle::from_degrees(15.0);
  /// Standard deviation of where an axis comes to stand about its reading; above 0 every view gets
  /// its own azimuth and tilt within it.
  Angle u_joint;
  /// The camera is found anew together with the axes, with its intrinsics as prior knowledge (they
  /// must come from other images). Otherwise it is kept and its uncertainty goes into the result.
  bool refine_camera = true;
  /// Also find the eccentricity of both encoders, with this prior standard deviation; 0: none.
  Angle u_eccentricity;
  double outlier_factor = 2.5;    ///< a view whose rms is above this times the median is left out
  double max_bad_fraction = 0.2;  ///< of the views; with more left out so, the step refuses
  double max_rms_px = 0.3;        ///< of all used views; above it the step refuses
};

/// Once per turn an encoder on an eccentric disc is off: the joint stands at
/// reading + a cos(reading) + b sin(reading).
struct Eccentricity {
  Angle a;
  Angle b;
};

/// Order of the errors in StageAxes::covariance. All in the world frame; mm or rad.
namespace stage_parameter {
inline constexpr Eigen::Index kCameraX = 0;  ///< camera centre along x; its y is 0
inline constexpr Eigen::Index kCameraZ = 1;
inline constexpr Eigen::Index kCameraTurn = 2;       ///< 3: camera turned about world x, y, z
inline constexpr Eigen::Index kAxisAngle = 5;        ///< tilt axis raised towards world z
inline constexpr Eigen::Index kTiltAxisHeading = 6;  ///< tilt axis turned about world z
inline constexpr Eigen::Index kSkew = 7;            ///< tilt axis moved along z cross its direction
inline constexpr Eigen::Index kBoardTurn = 8;       ///< board turned about world x at joint zero
inline constexpr Eigen::Index kBoardOrigin = 9;     ///< 3: board's origin at joint zero
inline constexpr Eigen::Index kAzimuthOffset = 12;  ///< about world z
inline constexpr Eigen::Index kTiltOffset = 13;     ///< about the tilt axis
inline constexpr Eigen::Index kEccentricity = 14;   ///< 4: a, b of azimuth, a, b of tilt
inline constexpr Eigen::Index kCamera = 18;         ///< 8: as CameraCovariance
inline constexpr Eigen::Index kCount = 26;
}  // namespace stage_parameter

/// The rig as the board has shown it.
///
/// Gauge    World: z = azimuth axis (on the side of the nominal one), origin = the point of it that
///          is nearest to the tilt axis, x = the camera centre's side across z. At azimuth 0 and
///          tilt 0 the board's normal is x. (The middle of the common perpendicular, of which the
///          specification speaks, turns with the azimuth and is no point of the world.)
struct StageAxes {
  /// The nominal rig with camera, azimuth, tilt and the sample's home pose as found, so that
  /// rig::forward(rig, corrected(readings)) shows the board where the camera saw it. The lamp is
  /// still nominal. The sample's frame at home: z the board's outward normal, x as nominal, origin
  /// in the board's face on the world's x axis.
  rig::RigDescription rig;
  instrument::CameraModel camera;
  Eigen::Isometry3d board_from_sample = Eigen::Isometry3d::Identity();  ///< mm; the board's mount
  Eccentricity azimuth_eccentricity;
  Eccentricity tilt_eccentricity;
  Eigen::MatrixXd covariance;     ///< of the errors in the order of stage_parameter
  double rms_px = 0.0;            ///< of the corners' distances from the model, used views
  double sigma_px = 0.0;          ///< standard deviation of one coordinate of a corner
  std::vector<FittedView> views;  ///< as given
  /// Per view, as given: by how much azimuth and tilt stand off their readings (rad) where all else
  /// is as found, from this view's corners alone. Not a number for views left out.
  std::vector<Eigen::Vector2d> joint_residuals;
  std::vector<std::string> notes;  ///< what a person should know: an axis that counts backwards
};

/// Axes, zeros, camera pose and mount from views of the board at many joints: bundle adjustment.
///
/// `nominal`  An LA-2: fixed camera, azimuth about z, tilt inside; within about 15 deg of what is
///            there. Whether an axis counts the other way round is found from the views: the sign
///            of its link's scale.
/// `camera`   Intrinsics with covariance. The views should cover pairs at equal tilt and pairs at
///            equal azimuth (a grid).
/// Threads    Any.
/// Errors     StepRefused: another kind of rig, too few views or corners, joints that are not one
///            per axis or no numbers, corners as fit_intrinsics, axes that move too little, turn at
///            another rate or stand elsewhere than nominal, views that contradict each other.
/// Source     Triggs et al. 2000 (least_squares.h); start from relative rotations as Tsai and Lenz,
///            IEEE Trans. Robotics and Automation 5, 1989.
StageAxes fit_stage_axes(const rig::RigDescription& nominal, const Intrinsics& camera,
                         std::span<const StageView> views, const StageAxesOptions& options = {});

/// Readings freed of the eccentricities found; what rig::forward takes.
rig::Joints corrected(const StageAxes& stage, const rig::Joints& readings);

/// The stage with errors (order of stage_parameter) added: for propagating the covariance.
StageAxes perturbed(const StageAxes& stage, const Eigen::VectorXd& errors);

/// `one` without what the board leans by in its mount, which `turned`, of the board turned by half
/// a turn in it, has the other way: the mean of both. In their gauge, where the board's normal is x
/// at joint zero, a lean is in the zeros of azimuth and tilt and turns the tilt axis with it. At
/// joint zero x becomes the normal of the datum that all targets lie on. Without it the mirror,
/// whose lean is found by turning it as well, would seem to lean by the board's, and the lamp be
/// off by twice that.
StageAxes on_its_datum(const StageAxes& one, const StageAxes& turned);

/// What does not depend on the gauge, with its uncertainty.
AngleEstimate axis_angle(const StageAxes& stage);  ///< between azimuth and tilt axis, 0 to 180 deg
LengthEstimate axis_skew(const StageAxes& stage);  ///< their distance along z cross tilt, signed
/// Unit vector from the camera's centre through a pixel, world frame.
DirectionEstimate pixel_ray(const StageAxes& stage, const Eigen::Vector2d& pixel);
/// The board's outward normal at some readings, world frame.
DirectionEstimate board_normal(const StageAxes& stage, const rig::Joints& readings);

}  // namespace gonio::calibration::geometry
