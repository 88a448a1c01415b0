#include "gonio/instrument/camera_model.h"

#include <stdexcept>

#include "gonio/errors/errors.h"

namespace gonio::instrument {
namespace {

Eigen::Vector2d distort(const CameraModel& camera, const Eigen::Vector2d& ideal) {
  const double r2 = ideal.squaredNorm();
  const double radial = 1.0 + r2 * (camera.k1 + r2 * camera.k2);
  const double xy = ideal.x() * ideal.y();
  return {
      ideal.x() * radial + 2.0 * camera.p1 * xy + camera.p2 * (r2 + 2.0 * ideal.x() * ideal.x()),
      ideal.y() * radial + camera.p1 * (r2 + 2.0 * ideal.y() * ideal.y()) + 2.0 * camera.p2 * xy};
}

}  // namespace

Eigen::Vector3d CameraModel::ray(double column, double row) const {
  const Eigen::Vector2d observed((column - cx_px) / fx_px, (row - cy_px) / fy_px);
  Eigen::Vector2d ideal = observed;
  constexpr int kMaxIterations = 100;
  constexpr double kTolerance = 1e-12;
  for (int i = 0; i < kMaxIterations; ++i) {
    const Eigen::Vector2d error = distort(*this, ideal) - observed;
    if (error.cwiseAbs().maxCoeff() < kTolerance) {
      return Eigen::Vector3d(ideal.x(), ideal.y(), 1.0).normalized();
    }
    ideal -= error;  // a contraction wherever the distortion is small against the image
  }
  throw NumericalError("camera distortion cannot be inverted at pixel (" + std::to_string(column) +
                       ", " + std::to_string(row) + ")");
}

Eigen::Vector2d CameraModel::project(const Eigen::Vector3d& point_in_camera) const {
  if (!(point_in_camera.z() > 0.0)) {
    throw std::invalid_argument("a point behind the camera has no pixel");
  }
  const Eigen::Vector2d observed = distort(*this, point_in_camera.head<2>() / point_in_camera.z());
  return {cx_px + fx_px * observed.x(), cy_px + fy_px * observed.y()};
}

}  // namespace gonio::instrument
