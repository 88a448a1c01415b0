#pragma once

#include <Eigen/Geometry>
#include <chrono>
#include <cstddef>
#include <string>
#include <vector>

#include "gonio/units/angle.h"

namespace gonio::rig {

/// One joint angle per axis, in the order of RigDescription::axes.
using Joints = std::vector<Angle>;

/// A motorised axis as motion planning sees it.
struct Axis {
  std::string name;  ///< "lamp_arm", "azimuth", "tilt" on LA-2
  Angle min;         ///< soft limits, inclusive (compared with a tolerance of 1e-9 rad)
  Angle max;
  double max_speed_deg_per_s = 20.0;
  double acceleration_deg_per_s2 = 30.0;
  std::chrono::milliseconds settle{300};
  /// Every target is approached with rising joint angle; a falling move first overshoots by this.
  /// 0: approached from either side.
  Angle approach_overshoot;
  Angle home;  ///< where the axis stands after homing
};

/// One joint of a serial chain, as a screw in the world frame at joint angle zero.
struct ChainLink {
  std::size_t axis = 0;       ///< index into RigDescription::axes
  Eigen::Vector3d direction;  ///< unit, world frame, right-hand rule
  Eigen::Vector3d point_mm;   ///< any point of the axis, world frame; unused by a slide
  double scale = 1.0;         ///< not 0; -1 where the stage counts the other way round
  Angle offset;               ///< turns by scale * joint + offset
  /// Not 0: a slide along `direction`, driven by a screw of this lead; it travels by
  /// lead_mm_per_turn for every turn of scale * joint + offset.
  double lead_mm_per_turn = 0.0;
};

/// Product of exponentials, base to tip: T(q) = exp(xi_1 q_1) ... exp(xi_n q_n) * home_pose.
struct Chain {
  std::vector<ChainLink> links;
  Eigen::Isometry3d home_pose = Eigen::Isometry3d::Identity();  ///< world_from_tip at zero, mm
};

/// A forbidden box in joint space; axes left out are unbounded. Checked at poses and along paths.
struct KeepOut {
  struct Range {
    std::size_t axis;
    Angle min;
    Angle max;
  };
  std::string name;
  std::vector<Range> ranges;
};

/// What the sample's size and the camera's field allow. A length or angle of 0 is not checked.
struct FootprintLimits {
  double sample_half_width_mm = 0.0;  ///< flat sample, measured from its origin
  double edge_margin_mm = 0.0;        ///< rim that is not used: holder, defocus
  /// A spot of this half width across the line of sight is averaged into one value; slanted, it
  /// covers spot / cos theta_o of the sample and has to stay on it.
  double spot_half_width_mm = 0.0;
  /// The usable sample, foreshortened by cos theta_o, has to stay this large for the camera.
  double min_projected_half_width_mm = 0.0;
  /// The usable sample has to lie within this angle of the optical axis, seen from the camera.
  Angle camera_half_field;
};

/// What the rig can measure besides its axis limits; inclusive with a tolerance of 1e-9 rad.
struct MeasurementLimits {
  Angle theta_i_max = Angle::from_degrees(80.01);
  Angle theta_o_max = Angle::from_degrees(80.01);
  Angle theta_d_min = Angle::from_degrees(3.75);  ///< the lamp head enters the camera's cone below
  FootprintLimits footprint;
};

/// A goniometer: named axes and three chains that share them.
///
/// Frames   World: the rig's own (LA-2: z = common vertical axis, x towards the camera). Camera
/// tip:
///          z forward along the optical axis, x right, y down in the image. Lamp tip: origin at the
///          source, z towards the sample. Sample tip: z = surface normal, x = sample mark, origin
///          in the surface.
struct RigDescription {
  std::string name;
  std::vector<Axis> axes;
  Chain camera;
  Chain lamp;
  Chain sample;
  bool collimated_lamp = false;
  MeasurementLimits limits;
  std::vector<KeepOut> keep_outs;
  bool simultaneous_axes = true;  ///< false: one axis moves at a time (a single slow bus)

  /// Throws std::invalid_argument naming the field ("axes[1].min: ..."): no axis, duplicate names,
  /// min > max, speed or acceleration not positive, direction not unit, link or keep-out to a
  /// missing axis, home outside limits, a home pose that is no rotation, anything not finite.
  void validate() const;

  /// Joint angles after homing.
  Joints home() const;
};

/// The reference rig: fixed camera on +x, lamp arm and azimuth coaxial on the vertical axis, tilt
/// inside. The axes "lamp_arm", "azimuth", "tilt" (alpha, beta, gamma of the formulas) have
/// limits [7.5, 165], [-85, 85], [-5, 70] deg, at most 20, 20, 10 deg/s and 30, 40, 20 deg/s^2,
/// settling in 0.3 s, homed at 90, 0, 0 deg. Distances are from the axes' common point.
RigDescription la2(double camera_distance_mm = 350.0, double lamp_distance_mm = 500.0);

}  // namespace gonio::rig
