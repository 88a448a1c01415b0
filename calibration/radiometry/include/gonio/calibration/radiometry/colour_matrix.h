#pragma once

#include <Eigen/Core>
#include <vector>

namespace gonio::calibration {

/// A patch of the colour chart.
struct ChartPatch {
  Eigen::Vector3d camera;  ///< BRDF * pi as measured, per camera colour
  Eigen::Vector3d target;  ///< linear sRGB of the chart's certificate, white = 1
  double weight = 1.0;     ///< above 0
};

/// What the matrix makes of a patch.
struct PatchFit {
  Eigen::Vector3d certified;  ///< ChartPatch::target
  Eigen::Vector3d found;      ///< linear sRGB, white = 1; not clipped
  double delta_e = 0.0;       ///< CIEDE2000 between the two
};

struct ColourMatrix {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();  ///< target = matrix * camera
  double mean_delta_e = 0.0;                             ///< CIEDE2000 over the patches
  double max_delta_e = 0.0;
  std::vector<PatchFit> patches;  ///< as given
};

/// Weighted least squares over the patches with the white kept: matrix * camera_white =
/// target_white (one Lagrange multiplier per row). Values may come out negative; nothing is
/// clipped.
///
/// Throws   StepRefused: fewer than 6 patches, patches that do not span the colours, a mean
///          CIEDE2000 above `limit` (the wrong chart, or turned by half a turn).
ColourMatrix fit_colour_matrix(const std::vector<ChartPatch>& patches,
                               const Eigen::Vector3d& camera_white,
                               const Eigen::Vector3d& target_white, double limit = 2.0);

}  // namespace gonio::calibration
