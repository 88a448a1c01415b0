#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "gonio/calibration/geometry/board_view.h"
#include "gonio/instrument/camera_model.h"
#include "gonio/units/angle.h"

namespace gonio::calibration::geometry {

struct IntrinsicsOptions {
  int width_px = 0;  ///< of the images the views come from
  int height_px = 0;
  std::size_t min_views = 8;
  std::size_t min_corners = 12;  ///< per view
  /// Views slanted more are left out: corners are found badly there.
  Angle max_slant = Angle::from_degrees(45.0);
  /// Two views at least must differ by this in the direction of the board's normal.
  Angle min_variation = Angle::from_degrees(20.0);
  double outlier_factor = 2.5;    ///< a view whose rms is above this times the median is left out
  double max_bad_fraction = 0.2;  ///< of the views; with more left out so, the step refuses
  double max_relative_sigma = 0.005;  ///< of the focal lengths; above it the step refuses
};

/// What became of one view.
struct FittedView {
  bool used = true;
  std::string why_not;   ///< empty when used
  bool bad_fit = false;  ///< left out since it contradicts the others
  Eigen::Isometry3d camera_from_board = Eigen::Isometry3d::Identity();  ///< mm
  Angle slant;          ///< between the board's normal and the line of sight to its middle
  double rms_px = 0.0;  ///< of the corners' distances from the model
};

/// Order of the camera's parameters in every covariance: fx fy cx cy (px) k1 k2 p1 p2.
inline constexpr Eigen::Index kCameraParameters = 8;
using CameraCovariance = Eigen::Matrix<double, kCameraParameters, kCameraParameters>;

struct Intrinsics {
  instrument::CameraModel camera;
  CameraCovariance covariance;
  double rms_px = 0.0;            ///< of the corners' distances from the model, used views
  double sigma_px = 0.0;          ///< standard deviation of one coordinate of a corner
  std::vector<FittedView> views;  ///< as given
};

/// Camera model from views of a flat board in many places.
///
/// Method   Closed form from homographies, then least squares over camera and poses (Huber at 3
///          sigma); views slanted too much or fitted badly are left out.
/// Threads  Any.
/// Errors   StepRefused: too few views or corners, corners that are no numbers, outside the image,
///          given twice or with two places on the board; views too much alike; a focal length that
///          stays uncertain. std::invalid_argument: an image size that is not positive.
/// Source   Zhang, "A Flexible New Technique for Camera Calibration", IEEE TPAMI 22, 2000,
///          sections 3.1 and 3.2 (without skew).
Intrinsics fit_intrinsics(std::span<const BoardView> views, const IntrinsicsOptions& options);

}  // namespace gonio::calibration::geometry
