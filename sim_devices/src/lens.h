#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "gonio/sim/sim_options.h"

namespace gonio::sim {

/// Where the pixels look: one ray per pixel, worked out once.
class Lens {
 public:
  explicit Lens(const CameraOptions& camera);

  std::size_t width() const { return width_; }
  std::size_t height() const { return x_.size() / width_; }

  /// Direction of a pixel in the camera frame, as (x, y) of (x, y, 1).
  Eigen::Vector2d ray(std::size_t pixel) const { return {x_[pixel], y_[pixel]}; }
  /// The same of all pixels: their x, and their y.
  std::span<const double> all_x() const { return x_; }
  std::span<const double> all_y() const { return y_; }

  /// Direction of a place in a pixel, in pixels to the right of and down from its middle (within
  /// +-0.5), as ray().
  Eigen::Vector2d ray_in(std::size_t row, std::size_t column, double right, double down) const {
    const std::size_t pixel = row * width_ + column;
    // From one pixel to the next the lens' distortion is straight.
    const std::size_t beside = column + 1 < width_ ? pixel : pixel - 1;
    const std::size_t below = pixel + width_ < x_.size() ? pixel : pixel - width_;
    return ray(pixel) + right * (ray(beside + 1) - ray(beside)) +
           down * (ray(below + width_) - ray(below));
  }

  /// Falloff of a pixel, 1 on the axis.
  double vignetting(std::size_t pixel) const { return vignetting_[pixel]; }

 private:
  std::size_t width_;
  std::vector<double> x_;
  std::vector<double> y_;
  std::vector<float> vignetting_;
};

/// The ideal image coordinates that the lens distorts to `distorted` (both on the plane z = 1),
/// by Newton's method to 1e-12 px. Throws std::invalid_argument when there are none: the
/// distortion folds the image over before this point.
Eigen::Vector2d undistorted(const CameraOptions& camera, const Eigen::Vector2d& distorted);

}  // namespace gonio::sim
