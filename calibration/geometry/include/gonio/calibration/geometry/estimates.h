#pragma once

#include <Eigen/Core>

#include "gonio/calibration/result/estimate.h"
#include "gonio/units/angle.h"

namespace gonio::calibration::geometry {

struct LengthEstimate {
  double value_mm = 0.0;
  double sigma_mm = 0.0;
};

struct DirectionEstimate {
  Eigen::Vector3d direction;   ///< unit
  Eigen::Matrix3d covariance;  ///< of its components, rad^2; singular along the direction
  Angle sigma() const;         ///< standard uncertainty per axis across the direction (rms of two)
};

}  // namespace gonio::calibration::geometry
