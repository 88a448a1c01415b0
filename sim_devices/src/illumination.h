#pragma once

#include <Eigen/Geometry>
#include <array>

#include "gonio/rig/kinematics.h"
#include "gonio/sim/sim_options.h"

namespace gonio::sim {

/// Light at points of a target's plane, in the target's frame, for 1 W/sr along the lamp's axis.
///
/// Threads  const members from any thread.
class Illumination {
 public:
  /// `lamp_distance_mm`  From the lamp to the rig's centre when all axes are at home: there a
  ///                     collimated beam has the irradiance of a lamp that is not.
  Illumination(const rig::RigPose& pose, const Eigen::Isometry3d& target_from_world,
               const LampOptions& lamp, double lamp_distance_mm);

  struct Light {
    Eigen::Vector3d wi;  ///< unit, towards the lamp
    double irradiance;   ///< W m^-2; 0 when the light comes from below
  };
  Light at(double x_mm, double y_mm) const;

  /// Irradiance alone, W m^-2, of points of the plane z = 0; as at().
  struct Points {
    const double* x_mm;
    const double* y_mm;
    std::size_t count;
  };
  void irradiances(const Points& points, float* w_per_m2) const;

 private:
  Eigen::Vector3d lamp_;       ///< its place in the target's frame
  Eigen::Matrix3d into_lamp_;  ///< turns the target's axes into the lamp's
  std::array<double, 5> field_;
  bool collimated_;
  double lamp_distance_mm_;
};

}  // namespace gonio::sim
