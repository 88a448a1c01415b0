#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "gonio/calibration/geometry/board_view.h"
#include "gonio/instrument/camera_model.h"
#include "gonio/random/stream.h"

/// What a camera would see of a board: made from the camera model, not from the code under test.
namespace gonio::calibration::geometry::test {

/// Image sizes of the specification: the real camera, and a quarter of it.
enum class Scale { Full, Quarter };

inline double uniform(random::Stream& stream, double half_range) {
  return half_range * (2.0 * stream.uniform() - 1.0);
}

inline Eigen::Vector3d uniform_vector(random::Stream& stream, double half_range) {
  const double x = uniform(stream, half_range);
  const double y = uniform(stream, half_range);
  const double z = uniform(stream, half_range);
  return {x, y, z};
}

inline Eigen::Matrix3d turn(const Eigen::Vector3d& vector_deg) {
  const double radians = vector_deg.norm() * 3.14159265358979323846 / 180.0;
  if (radians == 0.0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(radians, vector_deg.normalized()).toRotationMatrix();
}

/// A lens and sensor with the hidden errors of the specification.
inline instrument::CameraModel hidden_camera(random::Stream& stream, Scale scale) {
  const double size = scale == Scale::Full ? 1.0 : 0.25;
  instrument::CameraModel camera;
  camera.width_px = static_cast<int>(2448 * size);
  camera.height_px = static_cast<int>(2048 * size);
  camera.fx_px = 5525.0 * size * (1.0 + uniform(stream, 0.005));
  camera.fy_px = camera.fx_px;
  camera.cx_px = 0.5 * (camera.width_px - 1) + size * uniform(stream, 8.0);
  camera.cy_px = 0.5 * (camera.height_px - 1) + size * uniform(stream, 8.0);
  camera.k1 = -0.12;
  camera.k2 = 0.05;
  camera.p1 = uniform(stream, 4e-4);
  camera.p2 = uniform(stream, 4e-4);
  return camera;
}

/// Inner corners of 11 x 9 squares of 8 mm about the board's middle, x right, y down, as seen, with
/// noise; corners outside the image are missing.
inline BoardView seen_board(const instrument::CameraModel& camera,
                            const Eigen::Isometry3d& camera_from_board, double noise_px,
                            random::Stream& stream) {
  BoardView view;
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 10; ++column) {
      const Eigen::Vector2d point(8.0 * column - 36.0, 8.0 * row - 28.0);
      Eigen::Vector2d pixel =
          camera.project(camera_from_board * Eigen::Vector3d(point.x(), point.y(), 0.0));
      pixel.x() += noise_px * stream.normal();
      pixel.y() += noise_px * stream.normal();
      const bool inside = pixel.x() >= 0.0 && pixel.y() >= 0.0 &&
                          pixel.x() <= camera.width_px - 1.0 && pixel.y() <= camera.height_px - 1.0;
      if (inside) view.corners.push_back({10 * row + column, pixel, point});
    }
  }
  return view;
}

/// How many of some deviations are within two of their standard uncertainties.
struct Coverage {
  int within = 0;
  int all = 0;
  void count(double error, double sigma) {
    ++all;
    if (std::abs(error) <= 2.0 * sigma) ++within;
  }
  double fraction() const { return static_cast<double>(within) / all; }
};

}  // namespace gonio::calibration::geometry::test
