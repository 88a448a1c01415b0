#pragma once

#include <Eigen/Core>

#include "gonio/calibration/geometry/stage_axes.h"

namespace gonio::calibration::geometry {

/// How a sample lies where the board lay.
struct SampleDatum {
  /// The sample's face from the board's face along the outward normal, mm: its thickness less the
  /// board's where both lie on the same datum, or the shim's thickness.
  double raised_mm = 0.0;
  double u_raised_mm = 0.05;
  Angle u_tilt = Angle::from_degrees(0.02);  ///< of the seat on the datum, about each axis
};

struct SamplePlane {
  rig::RigDescription rig;  ///< the stage's, with the sample's origin moved along its normal
  /// Of the face: tilt about sample x and y (rad) and distance from the world's origin along the
  /// normal (mm), at joint readings zero.
  Eigen::Matrix3d covariance;
};

/// The sample's face from the board's. Throws std::invalid_argument for a datum that is not finite
/// or has negative uncertainties.
SamplePlane sample_plane(const StageAxes& stage, const SampleDatum& datum);

}  // namespace gonio::calibration::geometry
