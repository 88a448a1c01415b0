#include "lens.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "gonio/parallel/parallel.h"

namespace gonio::sim {
namespace {

constexpr double kTolerancePx = 1e-12;
constexpr int kMaxSteps = 50;
constexpr std::size_t kLensRows = 16;

struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d jacobian;
};

/// Brown, "Close-range camera calibration", Photogrammetric Engineering 37(8), 1971.
Distorted distort(const CameraOptions& camera, const Eigen::Vector2d& ideal) {
  const double x = ideal.x();
  const double y = ideal.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (camera.k1 + r2 * camera.k2);
  const double radial_by_r2 = camera.k1 + 2.0 * r2 * camera.k2;
  Distorted result;
  result.point = {x * radial + 2.0 * camera.p1 * x * y + camera.p2 * (r2 + 2.0 * x * x),
                  y * radial + camera.p1 * (r2 + 2.0 * y * y) + 2.0 * camera.p2 * x * y};
  const double cross = 2.0 * x * y * radial_by_r2 + 2.0 * camera.p1 * x + 2.0 * camera.p2 * y;
  result.jacobian << radial + 2.0 * x * x * radial_by_r2 + 2.0 * camera.p1 * y +
                         6.0 * camera.p2 * x,
      cross, cross, radial + 2.0 * y * y * radial_by_r2 + 6.0 * camera.p1 * y + 2.0 * camera.p2 * x;
  return result;
}

}  // namespace

Eigen::Vector2d undistorted(const CameraOptions& camera, const Eigen::Vector2d& distorted) {
  const double tolerance = kTolerancePx / std::max(camera.fx_px, camera.fy_px);
  // Below this a step only stirs the rounding of coordinates near 1.
  const double floor = 4.0 * std::numeric_limits<double>::epsilon() * distorted.norm();
  Eigen::Vector2d ideal = distorted;
  for (int step = 0; step < kMaxSteps; ++step) {
    const Distorted here = distort(camera, ideal);
    if (!(here.jacobian.determinant() > 0.0)) break;
    const Eigen::Vector2d change = here.jacobian.inverse() * (distorted - here.point);
    ideal += change;
    if (change.norm() <= std::max(tolerance, floor)) return ideal;
  }
  throw std::invalid_argument(
      fmt::format("camera.k1, k2, p1, p2: found a distortion that folds the image at "
                  "({:.4g}, {:.4g}), expected one to one over the frame",
                  distorted.x(), distorted.y()));
}

Lens::Lens(const CameraOptions& camera) : width_(static_cast<std::size_t>(camera.width_px)) {
  const std::size_t width = width_;
  const auto height = static_cast<std::size_t>(camera.height_px);
  x_.resize(width * height);
  y_.resize(width * height);
  vignetting_.resize(width * height);
  parallel::for_each_block(0, height, kLensRows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      for (std::size_t column = 0; column < width; ++column) {
        const Eigen::Vector2d seen((static_cast<double>(column) - camera.cx_px) / camera.fx_px,
                                   (static_cast<double>(row) - camera.cy_px) / camera.fy_px);
        const double q = seen.squaredNorm();
        const auto& v = camera.vignetting;
        const std::size_t pixel = row * width + column;
        const Eigen::Vector2d ray = undistorted(camera, seen);
        x_[pixel] = ray.x();
        y_[pixel] = ray.y();
        vignetting_[pixel] =
            static_cast<float>(std::max(0.0, 1.0 + q * (v[0] + q * (v[1] + q * v[2]))));
      }
    }
  });
}

}  // namespace gonio::sim
