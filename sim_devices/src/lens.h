#pragma once

#include <Eigen/Core>
#include <vector>

#include "gonio/sim/sim_options.h"

namespace gonio::sim {

/// Where the pixels look: one ray per pixel, worked out once.
class Lens {
 public:
  explicit Lens(const CameraOptions& camera);

  /// Direction of a pixel in the camera frame, as (x, y) of (x, y, 1).
  const Eigen::Vector2d& ray(std::size_t pixel) const { return rays_[pixel]; }

  /// Falloff of a pixel, 1 on the axis.
  double vignetting(std::size_t pixel) const { return vignetting_[pixel]; }

 private:
  std::vector<Eigen::Vector2d> rays_;
  std::vector<float> vignetting_;
};

/// The ideal image coordinates that the lens distorts to `distorted` (both on the plane z = 1),
/// by Newton's method to 1e-12 px. Throws std::invalid_argument when there are none: the
/// distortion folds the image over before this point.
Eigen::Vector2d undistorted(const CameraOptions& camera, const Eigen::Vector2d& distorted);

}  // namespace gonio::sim
