#pragma once

#include <Eigen/Core>

namespace gonio::instrument {

/// Pinhole camera with radial and tangential distortion (Brown 1971; OpenCV's k1 k2 p1 p2).
///
/// Frame    Camera frame: z forward, x right (columns), y down (rows). Pixel (column, row) with
///          integer coordinates at pixel centres; the top left pixel is (0, 0).
struct CameraModel {
  int width_px = 0;
  int height_px = 0;
  double fx_px = 0.0;
  double fy_px = 0.0;
  double cx_px = 0.0;
  double cy_px = 0.0;
  double k1 = 0.0;
  double k2 = 0.0;
  double p1 = 0.0;
  double p2 = 0.0;

  /// Unit vector from the centre of projection through an (observed, distorted) pixel; the
  /// distortion is inverted to 1e-12 of the focal length.
  /// Throws NumericalError where the distortion cannot be inverted (far outside the image).
  Eigen::Vector3d ray(double column, double row) const;

  /// Pixel (column, row) of a point in the camera frame. Throws std::invalid_argument if z <= 0.
  Eigen::Vector2d project(const Eigen::Vector3d& point_in_camera) const;
};

}  // namespace gonio::instrument
