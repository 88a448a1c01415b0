#pragma once

#include <Eigen/Geometry>

#include "gonio/calibration/geometry/board_view.h"
#include "gonio/instrument/camera_model.h"

namespace gonio::calibration::geometry {

/// Homography from the board's plane (mm) to pixels reduced by the camera: pixel = c + f * result.
/// With f = 1 and c = 0 to pixels. Lens distortion is taken out when `camera` has some.
///
/// Errors   NumericalError when the corners lie on one line.
/// Source   Hartley and Zisserman, "Multiple View Geometry", 2nd ed., algorithm 4.2.
Eigen::Matrix3d homography_of(const BoardView& view, const instrument::CameraModel& camera);

/// Pose of the board in front of the camera, from a homography to reduced pixels. Good to start a
/// search from. Errors as homography_of.
Eigen::Isometry3d camera_from_board_of(const Eigen::Matrix3d& homography);

/// exp of a rotation vector (rad).
Eigen::Matrix3d rotation_by(const Eigen::Vector3d& vector);
/// The rotation vector of a rotation, at most half a turn long.
Eigen::Vector3d rotation_vector_of(const Eigen::Matrix3d& rotation);
/// The rotation nearest to a matrix.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& matrix);

/// Observed pixels minus where `camera` sees the points of a board; not a number for points that
/// are not in front of it. `residual` is x, y, x, y, ...
void pixel_residuals(const BoardView& view, const instrument::CameraModel& camera,
                     const Eigen::Isometry3d& camera_from_board,
                     Eigen::Ref<Eigen::VectorXd> residual);

/// The camera with its eight parameters (order of CameraCovariance) changed by `change`.
instrument::CameraModel changed_camera(const instrument::CameraModel& camera,
                                       const Eigen::VectorXd& change);
/// Steps for numeric derivatives by them: the projection is linear in each.
Eigen::VectorXd camera_steps();

inline constexpr double kAngleStep_rad = 1e-5;  // 6e-3 px on a board; pixels round at 1e-12
inline constexpr double kLengthStep_mm = 1e-3;

}  // namespace gonio::calibration::geometry
