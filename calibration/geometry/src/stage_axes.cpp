#include "gonio/calibration/geometry/stage_axes.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "board_checks.h"
#include "gonio/calibration/geometry/least_squares.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/errors/errors.h"
#include "plane_pose.h"
#include "stage_start.h"
#include "view_selection.h"

namespace gonio::calibration::geometry {
namespace {

namespace at = stage_parameter;

const char* const kMoved =
    "the board moved on its holder, or joints and images do not belong together";

bool with_eccentricity(const StageAxesOptions& options) { return options.u_eccentricity > Angle(); }

/// The errors that are searched for, camera last: all, or all but the eccentricities.
Eigen::VectorXd all_errors(const Eigen::VectorXd& searched) {
  if (searched.size() == at::kCount) return searched;
  Eigen::VectorXd all = Eigen::VectorXd::Zero(at::kCount);
  all.head(at::kEccentricity) = searched.head(at::kEccentricity);
  all.tail(kCameraParameters) = searched.tail(kCameraParameters);
  return all;
}

/// The other way round.
Eigen::MatrixXd searched_rows(const Eigen::MatrixXd& all, const StageAxesOptions& options) {
  if (with_eccentricity(options)) return all;
  Eigen::MatrixXd searched(at::kEccentricity + kCameraParameters, all.cols());
  searched << all.topRows(at::kEccentricity), all.bottomRows(kCameraParameters);
  return searched;
}

ResidualBlock view_block(const StageView& view, const StageGeometry& geometry,
                         const StageAxesOptions& options) {
  ResidualBlock block;
  block.observed = 2 * static_cast<Eigen::Index>(view.board.corners.size());
  const double u_joint = options.u_joint.radians();
  if (u_joint > 0.0) {
    block.priors = 2;
    block.local = Eigen::VectorXd::Zero(2);
    block.local_step = Eigen::VectorXd::Constant(2, kAngleStep_rad);
  }
  block.residual = [&view, geometry, u_joint](const Eigen::VectorXd& errors,
                                              const Eigen::VectorXd& jitter,
                                              Eigen::Ref<Eigen::VectorXd> residual) {
    const StageGeometry changed = geometry.changed_by(all_errors(errors));
    const Eigen::Vector2d turned =
        jitter.size() == 2 ? Eigen::Vector2d(jitter) : Eigen::Vector2d(Eigen::Vector2d::Zero());
    pixel_residuals(view.board, changed.camera, changed.camera_from_board(view.joints, turned),
                    residual.head(residual.size() - jitter.size()));
    if (jitter.size() == 2) residual.tail<2>() = jitter / u_joint;
  };
  return block;
}

/// What the intrinsics step knows of the camera.
ResidualBlock camera_prior(const Intrinsics& known, const StageGeometry& geometry) {
  ResidualBlock block;
  block.priors = kCameraParameters;
  const Eigen::LLT<CameraCovariance> factor(known.covariance);
  if (factor.info() != Eigen::Success) {
    throw std::invalid_argument("stage axes: the covariance of the intrinsics is not positive");
  }
  const auto parameters = [](const instrument::CameraModel& c) {
    Eigen::Matrix<double, kCameraParameters, 1> p;
    p << c.fx_px, c.fy_px, c.cx_px, c.cy_px, c.k1, c.k2, c.p1, c.p2;
    return p;
  };
  const auto moved = (parameters(geometry.camera) - parameters(known.camera)).eval();
  block.residual = [factor, moved](const Eigen::VectorXd& errors, const Eigen::VectorXd&,
                                   Eigen::Ref<Eigen::VectorXd> residual) {
    residual = factor.matrixL().solve(moved + errors.tail<kCameraParameters>());
  };
  return block;
}

ResidualBlock eccentricity_prior(const StageGeometry& geometry, const StageAxesOptions& options) {
  ResidualBlock block;
  block.priors = 4;
  const double u = options.u_eccentricity.radians();
  const Eigen::Vector4d found(
      geometry.azimuth_eccentricity.a.radians(), geometry.azimuth_eccentricity.b.radians(),
      geometry.tilt_eccentricity.a.radians(), geometry.tilt_eccentricity.b.radians());
  block.residual = [u, found](const Eigen::VectorXd& errors, const Eigen::VectorXd&,
                              Eigen::Ref<Eigen::VectorXd> residual) {
    residual = (found + errors.segment<4>(at::kEccentricity)) / u;
  };
  return block;
}

LeastSquaresProblem problem_about(const StageGeometry& geometry, const Intrinsics& camera,
                                  std::span<const StageView> views,
                                  const std::vector<FittedView>& fitted, double sigma_px,
                                  const StageAxesOptions& options) {
  LeastSquaresProblem problem;
  problem.components = 2;
  problem.sigma = sigma_px;
  problem.global_step = searched_rows(stage_steps(), options);
  problem.global = Eigen::VectorXd::Zero(problem.global_step.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (fitted[v].used) problem.blocks.push_back(view_block(views[v], geometry, options));
  }
  if (with_eccentricity(options)) {
    problem.blocks.push_back(eccentricity_prior(geometry, options));
  }
  if (options.refine_camera) {
    problem.blocks.push_back(camera_prior(camera, geometry));
  } else {
    problem.considered_covariance = camera.covariance;
  }
  return problem;
}

Eigen::MatrixXd full_covariance(const Eigen::MatrixXd& searched) {
  if (searched.rows() == at::kCount) return searched;
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(at::kCount, at::kCount);
  const Eigen::Index head = at::kEccentricity;
  const Eigen::Index tail = kCameraParameters;
  all.topLeftCorner(head, head) = searched.topLeftCorner(head, head);
  all.topRightCorner(head, tail) = searched.topRightCorner(head, tail);
  all.bottomLeftCorner(tail, head) = searched.bottomLeftCorner(tail, head);
  all.bottomRightCorner(tail, tail) = searched.bottomRightCorner(tail, tail);
  return all;
}

/// Searches from `geometry` and again from what was found, so that the covariance is of errors
/// about the result.
void refine_stage(StageGeometry& geometry, const Intrinsics& camera,
                  std::span<const StageView> views, const StageAxesOptions& options,
                  StageAxes& result) {
  LeastSquaresSolution solution;
  double sigma_px = 1.0;
  for (int pass = 0; pass < 2; ++pass) {
    solution = solve(problem_about(geometry, camera, views, result.views, sigma_px, options));
    geometry = geometry.changed_by(all_errors(solution.global));
    sigma_px = solution.sigma;
  }
  result.covariance = full_covariance(solution.covariance);
  result.sigma_px = solution.sigma;
  double squares = 0.0;
  double corners = 0.0;
  std::size_t block = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    FittedView& fitted = result.views[v];
    if (!fitted.used) continue;
    const auto size = 2 * static_cast<Eigen::Index>(views[v].board.corners.size());
    const Eigen::VectorXd pixels = solution.residuals[block].head(size);
    const Eigen::VectorXd jitter = solution.local[block];
    fitted.camera_from_board = geometry.camera_from_board(
        views[v].joints,
        jitter.size() == 2 ? Eigen::Vector2d(jitter) : Eigen::Vector2d(Eigen::Vector2d::Zero()));
    fitted.rms_px = rms_of_pixels(pixels);
    squares += pixels.squaredNorm();
    corners += 0.5 * static_cast<double>(size);
    ++block;
  }
  result.rms_px = std::sqrt(squares / corners);
}

/// Where a view's corners say that its two joints stand, off their readings (rad). Gauss-Newton
/// without the prior of the search: an axis that is off by more than it should be shows in full.
Eigen::Vector2d joint_residual(const StageView& view, const StageGeometry& geometry) {
  const auto size = 2 * static_cast<Eigen::Index>(view.board.corners.size());
  const auto residual = [&](const Eigen::Vector2d& turned) {
    Eigen::VectorXd pixels(size);
    pixel_residuals(view.board, geometry.camera, geometry.camera_from_board(view.joints, turned),
                    pixels);
    return pixels;
  };
  Eigen::Vector2d turned = Eigen::Vector2d::Zero();
  constexpr int kSteps = 3;  // of a problem that is nearly linear: arc minutes at most
  for (int k = 0; k < kSteps; ++k) {
    Eigen::MatrixX2d jacobian(size, 2);
    for (Eigen::Index axis = 0; axis < 2; ++axis) {
      const Eigen::Vector2d step = kAngleStep_rad * Eigen::Vector2d::Unit(axis);
      jacobian.col(axis) =
          (residual(turned + step) - residual(turned - step)) / (2.0 * kAngleStep_rad);
    }
    turned -=
        (jacobian.transpose() * jacobian).ldlt().solve(jacobian.transpose() * residual(turned));
  }
  return turned;
}

void store_joint_residuals(const StageGeometry& geometry, std::span<const StageView> views,
                           StageAxes& result) {
  for (std::size_t v = 0; v < views.size(); ++v) {
    result.joint_residuals.push_back(
        result.views[v].used
            ? joint_residual(views[v], geometry)
            : Eigen::Vector2d(Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN())));
  }
}

}  // namespace

StageAxes fit_stage_axes(const rig::RigDescription& nominal, const Intrinsics& camera,
                         std::span<const StageView> views, const StageAxesOptions& options) {
  const std::string step = "stage axes";
  require_la2(step, nominal);
  std::vector<BoardView> boards;
  for (std::size_t v = 0; v < views.size(); ++v) {
    check_joints(step, fmt::format("view {}", v), nominal, views[v].joints);
    boards.push_back(views[v].board);
  }
  check_views(step, boards, options.min_corners, camera.camera.width_px, camera.camera.height_px);

  StageAxes result;
  result.rig = nominal;
  result.views.resize(views.size());
  try {
    for (std::size_t v = 0; v < views.size(); ++v) {
      FittedView& fitted = result.views[v];
      fitted.camera_from_board = camera_from_board_of(homography_of(boards[v], camera.camera));
      fitted.slant = slant_of(boards[v], fitted.camera_from_board);
    }
    leave_out_slanted(result.views, options.max_slant);
    require_views(step, result.views, options.min_views);
    StageGeometry geometry =
        start_of_stage(nominal, camera.camera, views, result.views, options, result.notes);
    refine_stage(geometry, camera, views, options, result);
    while (leave_out_bad(result.views, options.outlier_factor)) {
      require_agreement(step, result.views, options.max_bad_fraction, kMoved);
      require_views(step, result.views, options.min_views);
      refine_stage(geometry, camera, views, options, result);
    }
    store_joint_residuals(geometry, views, result);
    store(geometry, result);
  } catch (const NumericalError& error) {
    throw StepRefused(
        fmt::format("{}: the views give no axes ({}): take more, on a grid of "
                    "azimuth and tilt",
                    step, error.what()));
  }
  if (!(result.rms_px <= options.max_rms_px)) {
    throw StepRefused(
        fmt::format("{}: the views fit with {:.2f} px rms, expected {:.2f} at most: {}", step,
                    result.rms_px, options.max_rms_px, kMoved));
  }
  result.rig.validate();
  return result;
}

}  // namespace gonio::calibration::geometry
