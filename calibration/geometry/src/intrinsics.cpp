#include "gonio/calibration/geometry/intrinsics.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "board_checks.h"
#include "gonio/calibration/geometry/least_squares.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/errors/errors.h"
#include "plane_pose.h"
#include "view_selection.h"

namespace gonio::calibration::geometry {
namespace {

using instrument::CameraModel;

const char* const kTiltMore = "tilt the board by 20 to 40 deg in different directions";

/// Pixels about the image's middle in units of its width, for equations that are well scaled.
CameraModel image_units(const IntrinsicsOptions& options) {
  const double unit = options.width_px;
  return {.width_px = options.width_px,
          .height_px = options.height_px,
          .fx_px = unit,
          .fy_px = unit,
          .cx_px = 0.5 * (options.width_px - 1),
          .cy_px = 0.5 * (options.height_px - 1)};
}

CameraModel camera_from_units(const CameraModel& units, double fx, double fy, double cx,
                              double cy) {
  CameraModel camera = units;
  camera.cx_px += cx * units.fx_px;
  camera.cy_px += cy * units.fy_px;
  camera.fx_px *= fx;
  camera.fy_px *= fy;
  return camera;
}

/// Zhang's closed form without skew; nothing where noise makes it imaginary or absurd.
std::optional<CameraModel> closed_form(const std::vector<Eigen::Matrix3d>& homographies,
                                       const CameraModel& units) {
  // h_i^T B h_j with B = K^-T K^-1, unknown (B11, B22, B13, B23, B33).
  const auto row = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    Eigen::Matrix<double, 1, 5> result;
    result << a.x() * b.x(), a.y() * b.y(), a.x() * b.z() + a.z() * b.x(),
        a.y() * b.z() + a.z() * b.y(), a.z() * b.z();
    return result;
  };
  Eigen::MatrixXd equations(2 * static_cast<Eigen::Index>(homographies.size()), 5);
  Eigen::Index k = 0;
  for (const Eigen::Matrix3d& h : homographies) {
    equations.row(k++) = row(h.col(0), h.col(1));
    equations.row(k++) = row(h.col(0), h.col(0)) - row(h.col(1), h.col(1));
  }
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(equations, Eigen::ComputeFullV);
  Eigen::VectorXd b = svd.matrixV().col(4);
  if (b[0] < 0.0) b = -b;
  const double lambda = b[4] - b[2] * b[2] / b[0] - b[3] * b[3] / b[1];
  if (!(b[0] > 0.0 && b[1] > 0.0 && lambda > 0.0)) return std::nullopt;
  const double fx = std::sqrt(lambda / b[0]);
  const double fy = std::sqrt(lambda / b[1]);
  const double cx = -b[2] / b[0];
  const double cy = -b[3] / b[1];
  // Square pixels within 20 %, principal point in the middle half: what lenses are like.
  const bool plausible = std::abs(fx / fy - 1.0) < 0.2 && std::hypot(cx, cy) < 0.25;
  if (!plausible) return std::nullopt;
  return camera_from_units(units, fx, fy, cx, cy);
}

/// Square pixels and the principal point in the middle: one unknown, 1/f^2.
std::optional<CameraModel> one_focal_length(const std::vector<Eigen::Matrix3d>& homographies,
                                            const CameraModel& units) {
  double product = 0.0;
  double square = 0.0;
  for (const Eigen::Matrix3d& h : homographies) {
    const Eigen::Vector3d a = h.col(0);
    const Eigen::Vector3d b = h.col(1);
    const Eigen::Vector2d coefficient(a.head<2>().dot(b.head<2>()),
                                      a.head<2>().squaredNorm() - b.head<2>().squaredNorm());
    const Eigen::Vector2d right(-a.z() * b.z(), b.z() * b.z() - a.z() * a.z());
    product += coefficient.dot(right);
    square += coefficient.squaredNorm();
  }
  if (!(square > 0.0 && product > 0.0)) return std::nullopt;
  const double f = std::sqrt(square / product);
  return camera_from_units(units, f, f, 0.0, 0.0);
}

CameraModel first_guess(std::span<const BoardView> views, const IntrinsicsOptions& options) {
  const CameraModel units = image_units(options);
  std::vector<Eigen::Matrix3d> homographies;
  for (const BoardView& view : views) {
    const Eigen::Matrix3d h = homography_of(view, units);
    homographies.emplace_back(h / std::sqrt(h.col(0).norm() * h.col(1).norm()));
  }
  const auto full = closed_form(homographies, units);
  const auto guess = full ? full : one_focal_length(homographies, units);
  // Fields from fisheye to telescope.
  if (!guess || guess->fx_px < 0.2 * units.fx_px || guess->fx_px > 100.0 * units.fx_px) {
    throw StepRefused(
        fmt::format("intrinsics: {} views do not tell the focal length, since their "
                    "slants do not vary enough: {}",
                    views.size(), kTiltMore));
  }
  return *guess;
}

/// Largest angle between the normals of two used views.
Angle variation_of(const std::vector<FittedView>& views) {
  double largest = 0.0;
  for (const FittedView& a : views) {
    for (const FittedView& b : views) {
      if (!a.used || !b.used) continue;
      const Eigen::Vector3d n = a.camera_from_board.linear().col(2);
      const Eigen::Vector3d m = b.camera_from_board.linear().col(2);
      largest = std::max(largest, std::atan2(n.cross(m).norm(), std::abs(n.dot(m))));
    }
  }
  return Angle::from_radians(largest);
}

/// Camera and poses of the used views by least squares, from what `result` holds.
void refine(std::span<const BoardView> views, Intrinsics& result) {
  LeastSquaresProblem problem;
  problem.components = 2;
  problem.global = Eigen::VectorXd::Zero(kCameraParameters);
  problem.global_step = camera_steps();
  std::vector<std::size_t> members;
  const CameraModel start = result.camera;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!result.views[v].used) continue;
    members.push_back(v);
    const BoardView& view = views[v];
    const Eigen::Isometry3d pose = result.views[v].camera_from_board;
    ResidualBlock block;
    block.observed = 2 * static_cast<Eigen::Index>(view.corners.size());
    block.local = Eigen::VectorXd::Zero(6);
    block.local_step = Eigen::VectorXd::Constant(6, kAngleStep_rad);
    block.local_step.tail<3>().setConstant(kLengthStep_mm);
    block.residual = [&view, start, pose](const Eigen::VectorXd& camera,
                                          const Eigen::VectorXd& change,
                                          Eigen::Ref<Eigen::VectorXd> residual) {
      Eigen::Isometry3d moved = pose;
      moved.linear() = rotation_by(change.head<3>()) * pose.linear();
      moved.translation() += change.tail<3>();
      pixel_residuals(view, changed_camera(start, camera), moved, residual);
    };
    problem.blocks.push_back(std::move(block));
  }
  const LeastSquaresSolution solution = solve(problem);

  result.camera = changed_camera(start, solution.global);
  result.covariance = solution.covariance;
  result.sigma_px = solution.sigma;
  double squares = 0.0;
  double corners = 0.0;
  for (std::size_t b = 0; b < members.size(); ++b) {
    FittedView& fitted = result.views[members[b]];
    Eigen::Isometry3d& pose = fitted.camera_from_board;
    pose.linear() = rotation_by(solution.local[b].head<3>()) * pose.linear();
    pose.translation() += solution.local[b].tail<3>();
    fitted.slant = slant_of(views[members[b]], pose);
    fitted.rms_px = rms_of_pixels(solution.residuals[b]);
    squares += solution.residuals[b].squaredNorm();
    corners += 0.5 * static_cast<double>(solution.residuals[b].size());
  }
  result.rms_px = std::sqrt(squares / corners);
}

void require_certainty(const Intrinsics& result, const IntrinsicsOptions& options) {
  const Angle variation = variation_of(result.views);
  if (variation < options.min_variation) {
    throw StepRefused(fmt::format(
        "intrinsics: the normals of {} views lie within {:.1f} deg, "
        "expected {:.0f} at least: {}",
        used_count(result.views), variation.degrees(), options.min_variation.degrees(), kTiltMore));
  }
  const double relative = std::max(std::sqrt(result.covariance(0, 0)) / result.camera.fx_px,
                                   std::sqrt(result.covariance(1, 1)) / result.camera.fy_px);
  if (!(relative <= options.max_relative_sigma)) {
    throw StepRefused(
        fmt::format("intrinsics: the focal length is uncertain by {:.2f} %, expected "
                    "{:.2f} at most: {}",
                    100.0 * relative, 100.0 * options.max_relative_sigma, kTiltMore));
  }
}

}  // namespace

Intrinsics fit_intrinsics(std::span<const BoardView> views, const IntrinsicsOptions& options) {
  if (options.width_px < 1 || options.height_px < 1) {
    throw std::invalid_argument("intrinsics: the image size must be positive");
  }
  check_views("intrinsics", views, options.min_corners, options.width_px, options.height_px);
  Intrinsics result;
  result.views.resize(views.size());
  require_views("intrinsics", result.views, options.min_views);
  try {
    result.camera = first_guess(views, options);
    for (std::size_t v = 0; v < views.size(); ++v) {
      FittedView& fitted = result.views[v];
      fitted.camera_from_board = camera_from_board_of(homography_of(views[v], result.camera));
    }
    refine(views, result);
    // One look at slants and fits at a time: a bad view spoils the figures of good ones.
    if (leave_out_slanted(result.views, options.max_slant)) {
      require_views("intrinsics", result.views, options.min_views);
      refine(views, result);
    }
    while (leave_out_bad(result.views, options.outlier_factor)) {
      require_agreement("intrinsics", result.views, options.max_bad_fraction,
                        "the lens was touched or the board bends; take all again");
      require_views("intrinsics", result.views, options.min_views);
      refine(views, result);
    }
  } catch (const NumericalError& error) {
    throw StepRefused(fmt::format("intrinsics: {} views give no camera ({}): {}", views.size(),
                                  error.what(), kTiltMore));
  }
  require_certainty(result, options);
  return result;
}

}  // namespace gonio::calibration::geometry
