#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

namespace gonio::render {

/// Where the sphere lies in a square picture.
class SphereLayout {
 public:
  explicit SphereLayout(int size) : size_(size), centre_(0.5 * size), radius_(0.5 * size - 1.0) {
    if (size < 16 || size > 4096) {
      throw std::invalid_argument("sphere picture of " + std::to_string(size) +
                                  " pixels, must be in 16..4096");
    }
  }

  int size() const { return size_; }
  double radius_px() const { return radius_; }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(size_) +
           static_cast<std::size_t>(x);
  }

  /// Position on the unit disc of a point in pixels from the top left; y up.
  Eigen::Vector2d on_disc(double x_px, double y_px) const {
    return {(x_px - centre_) / radius_, (centre_ - y_px) / radius_};
  }

  /// Share of a pixel inside the disc; the rim is straight on the scale of a pixel.
  float coverage(int x, int y) const {
    const double distance = on_disc(x + 0.5, y + 0.5).norm() * radius_;
    return static_cast<float>(std::clamp(radius_ - distance + 0.5, 0.0, 1.0));
  }

  /// The normal there; outside of the rim, that of the rim's last half pixel.
  Eigen::Vector3d normal(double x_px, double y_px) const {
    Eigen::Vector2d p = on_disc(x_px, y_px);
    const double most = 1.0 - 0.5 / radius_;
    const double r = p.norm();
    if (r > most) p *= most / r;
    return {p.x(), p.y(), std::sqrt(std::max(0.0, 1.0 - p.squaredNorm()))};
  }

 private:
  int size_;
  double centre_;
  double radius_;
};

}  // namespace gonio::render
