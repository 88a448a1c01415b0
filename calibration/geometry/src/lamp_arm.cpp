#include "gonio/calibration/geometry/lamp_arm.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <stdexcept>
#include <utility>

#include "gonio/calibration/geometry/least_squares.h"
#include "gonio/calibration/result/step_refused.h"
#include "gonio/errors/errors.h"
#include "plane_pose.h"
#include "propagate.h"
#include "stage_geometry.h"

namespace gonio::calibration::geometry {
namespace {

namespace par = lamp_parameter;
const char* const kLampStep = "lamp arm";

/// The unknowns of the lamp in their gauge, and the mirror.
struct LampGeometry {
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();
  Eigen::Vector3d axis_point = Eigen::Vector3d::Zero();  // z = 0
  Eigen::Vector3d home;                                  // lamp at arm zero, y = 0
  double offset = 0.0;                                   // rad, about +z
  double scale = 1.0;                                    // turn about +z per joint angle
  Eigen::Vector2d mirror_tilt = Eigen::Vector2d::Zero();
  double mirror_offset_mm = 0.0;

  Eigen::Vector3d lamp_at(double joint) const {
    return turn_about(axis, axis_point, scale * joint + offset) * home;
  }

  LampGeometry changed_by(const Eigen::VectorXd& errors) const {
    LampGeometry changed = *this;
    const Eigen::Vector3d turn(errors[par::kAxisTurn], errors[par::kAxisTurn + 1], 0.0);
    changed.axis = (rotation_by(turn) * axis).normalized();
    changed.axis_point.head<2>() += errors.segment<2>(par::kAxisPoint);
    changed.home.x() += errors[par::kLampX];
    changed.home.z() += errors[par::kLampZ];
    changed.offset += errors[par::kOffset];
    changed.mirror_tilt += errors.segment<2>(par::kMirrorTilt);
    changed.mirror_offset_mm += errors[par::kMirrorOffset];
    return changed;
  }
};

double up_of(const rig::ChainLink& arm) { return arm.direction.z() < 0.0 ? -1.0 : 1.0; }

LampGeometry lamp_geometry_of(const rig::RigDescription& rig) {
  const rig::ChainLink& arm = rig.lamp.links.at(0);
  LampGeometry lamp;
  lamp.axis = up_of(arm) * arm.direction;
  // Where it meets z = 0.
  lamp.axis_point = arm.point_mm - arm.point_mm.z() / lamp.axis.z() * lamp.axis;
  lamp.home = rig.lamp.home_pose.translation();
  lamp.offset = up_of(arm) * arm.offset.radians();
  lamp.scale = up_of(arm) * arm.scale;
  return lamp;
}

void store_lamp(const LampGeometry& lamp, rig::RigDescription& rig) {
  rig::ChainLink& arm = rig.lamp.links.at(0);
  const double up = up_of(arm);
  arm.direction = up * lamp.axis;
  arm.point_mm = lamp.axis_point;
  arm.offset = Angle::from_radians(up * lamp.offset);
  arm.scale = up * lamp.scale;
  Eigen::Isometry3d& home = rig.lamp.home_pose;
  home.linear() =
      rotation_between(home.translation().normalized(), lamp.home.normalized()) * home.linear();
  home.translation() = lamp.home;
}

/// A mirror's plane in the world.
struct Plane {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;
};

/// The mirror lies on the board's plane, whose outward normal is x at joint zero.
Plane mirror_plane(const StageGeometry& stage, const rig::RigDescription& rig,
                   const LampGeometry& lamp, const MirrorView& view,
                   const Eigen::Vector2d& jitter) {
  const Eigen::Isometry3d world_from_board =
      stage.world_from_camera * stage.camera_from_board(view.joints, jitter);
  const Eigen::Isometry3d at_zero = world_from_board * stage.world_from_board.inverse();
  // Sample axes at joint zero, as StageAxes::rig has them.
  const Eigen::Matrix3d home = rig.sample.home_pose.linear();
  const Eigen::Vector2d tilt = view.turned ? -lamp.mirror_tilt : lamp.mirror_tilt;
  const Eigen::Vector3d tilted =
      home * rotation_by({tilt.x(), tilt.y(), 0.0}) * Eigen::Vector3d::UnitZ();
  const double face_mm = stage.world_from_board.translation().x() + lamp.mirror_offset_mm;
  return {at_zero * (face_mm * Eigen::Vector3d::UnitX()), at_zero.linear() * tilted};
}

ResidualBlock mirror_block(const StageAxes& stage, const StageGeometry& geometry,
                           const MirrorView& view, const LampGeometry& start, double u_joint) {
  const std::size_t arm_axis = stage.rig.lamp.links[0].axis;
  ResidualBlock block;
  block.observed = 2;
  if (u_joint > 0.0) {
    block.priors = 3;  // azimuth, tilt, arm
    block.local = Eigen::VectorXd::Zero(3);
    block.local_step = Eigen::VectorXd::Constant(3, kAngleStep_rad);
  }
  block.residual = [&stage, &geometry, &view, start, u_joint, arm_axis](
                       const Eigen::VectorXd& errors, const Eigen::VectorXd& jitter,
                       Eigen::Ref<Eigen::VectorXd> residual) {
    const LampGeometry lamp = start.changed_by(errors.head(par::kCount));
    const StageGeometry changed = geometry.changed_by(errors.tail(stage_parameter::kCount));
    const bool free = jitter.size() == 3;
    const Eigen::Vector2d turned =
        free ? Eigen::Vector2d(jitter.head<2>()) : Eigen::Vector2d(Eigen::Vector2d::Zero());
    const double arm = view.joints[arm_axis].radians() + (free ? jitter[2] : 0.0);
    const Plane mirror = mirror_plane(changed, stage.rig, lamp, view, turned);
    const Eigen::Vector3d source = lamp.lamp_at(arm);
    const Eigen::Vector3d image =
        source - 2.0 * mirror.normal.dot(source - mirror.point) * mirror.normal;
    const Eigen::Vector3d in_camera = changed.world_from_camera.inverse() * image;
    if (!(in_camera.z() > 0.0)) {
      residual.setConstant(std::numeric_limits<double>::quiet_NaN());
      return;
    }
    residual.head<2>() = view.pixel - changed.camera.project(in_camera);
    if (free) residual.tail<3>() = jitter / u_joint;
  };
  return block;
}

/// What is known of the mirror in its mount.
ResidualBlock mount_prior(const LampGeometry& start, const MirrorMount& mount) {
  ResidualBlock block;
  block.priors = 3;
  block.residual = [start, mount](const Eigen::VectorXd& errors, const Eigen::VectorXd&,
                                  Eigen::Ref<Eigen::VectorXd> residual) {
    const LampGeometry lamp = start.changed_by(errors.head(par::kCount));
    residual.head<2>() = lamp.mirror_tilt / mount.u_tilt.radians();
    residual[2] = (lamp.mirror_offset_mm - mount.offset_mm) / mount.u_offset_mm;
  };
  return block;
}

Eigen::VectorXd lamp_steps() {
  Eigen::VectorXd steps = Eigen::VectorXd::Constant(par::kCount, kAngleStep_rad);
  steps.segment<4>(par::kAxisPoint).setConstant(10.0 * kLengthStep_mm);
  steps[par::kMirrorOffset] = kLengthStep_mm;
  return steps;
}

void check_mirror_views(const StageAxes& stage, std::span<const MirrorView> views,
                        const LampArmOptions& options) {
  const auto& links = stage.rig.lamp.links;
  if (links.size() != 1 || links[0].lead_mm_per_turn != 0.0 || stage.rig.collimated_lamp ||
      std::abs(links[0].direction.z()) < 0.99 ||
      stage.rig.lamp.home_pose.translation().norm() < 1.0) {
    throw StepRefused(
        fmt::format("{}: the rig \"{}\" has no lamp on one arm about z, expected a "
                    "point lamp on a circle: describe it so",
                    kLampStep, stage.rig.name));
  }
  if (views.size() < options.min_views) {
    throw StepRefused(fmt::format("{}: {} mirror views, expected at least {}: take more", kLampStep,
                                  views.size(), options.min_views));
  }
  Angle low = Angle::from_radians(HUGE_VAL);
  Angle high = -low;
  for (std::size_t v = 0; v < views.size(); ++v) {
    check_joints(kLampStep, fmt::format("mirror view {}", v), stage.rig, views[v].joints);
    const Eigen::Vector2d& pixel = views[v].pixel;
    // A centre may lie outside by the part of the lamp's image that is cut off, no more.
    const bool inside =
        pixel.x() > -0.1 * stage.camera.width_px && pixel.y() > -0.1 * stage.camera.height_px &&
        pixel.x() < 1.1 * stage.camera.width_px && pixel.y() < 1.1 * stage.camera.height_px;
    if (!inside) {  // or not a number
      throw StepRefused(fmt::format(
          "{}: mirror view {} has the lamp at pixel ({}, {}), expected it "
          "in the image of {} x {}: find it again or leave the view out",
          kLampStep, v, pixel.x(), pixel.y(), stage.camera.width_px, stage.camera.height_px));
    }
    low = std::min(low, views[v].joints[links[0].axis]);
    high = std::max(high, views[v].joints[links[0].axis]);
  }
  if (high - low < options.min_arm_span) {
    throw StepRefused(
        fmt::format("{}: the arm spans {:.1f} deg, expected {:.0f} at least: take "
                    "views farther apart",
                    kLampStep, (high - low).degrees(), options.min_arm_span.degrees()));
  }
}

/// Azimuth of the lamp by following one view's ray over the mirror to the nominal circle.
double azimuth_seen(const StageGeometry& geometry, const rig::RigDescription& rig,
                    const LampGeometry& nominal, const MirrorView& view, std::size_t index) {
  const Plane mirror = mirror_plane(geometry, rig, nominal, view, Eigen::Vector2d::Zero());
  const Eigen::Vector3d centre = geometry.world_from_camera.translation();
  const Eigen::Vector3d ray =
      geometry.world_from_camera.linear() * geometry.camera.ray(view.pixel.x(), view.pixel.y());
  const double towards = mirror.normal.dot(ray);
  const double height = mirror.normal.dot(mirror.point - centre);
  const double radius = nominal.home.norm();
  const Eigen::Vector3d hit = centre + ray * (height / towards);
  if (!(towards < 0.0 && height < 0.0 && hit.norm() < radius)) {
    throw StepRefused(
        fmt::format("{}: the joints of mirror view {} turn the mirror away from the "
                    "camera: joints and images do not belong together",
                    kLampStep, index));
  }
  const Eigen::Vector3d reflected = ray - 2.0 * towards * mirror.normal;
  const double along = hit.dot(reflected);
  const double length = -along + std::sqrt(along * along + radius * radius - hit.squaredNorm());
  const Eigen::Vector3d lamp = hit + length * reflected;
  return std::atan2(lamp.y(), lamp.x());
}

/// Zero and way of counting from the azimuths seen.
LampGeometry start_of_lamp(const StageAxes& stage, const StageGeometry& geometry,
                           std::span<const MirrorView> views, const MirrorMount& mount,
                           std::vector<std::string>& notes) {
  LampGeometry lamp = lamp_geometry_of(stage.rig);
  lamp.mirror_offset_mm = mount.offset_mm;
  // In the gauge the lamp at arm zero stands at azimuth zero.
  lamp.home = {std::hypot(lamp.home.x(), lamp.home.y()), 0.0, lamp.home.z()};
  const double nominal_scale = lamp.scale;
  double best = -1.0;
  for (const double sign : {1.0, -1.0}) {
    std::complex<double> sum = 0.0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      const double joint = views[v].joints[stage.rig.lamp.links[0].axis].radians();
      const double seen = azimuth_seen(geometry, stage.rig, lamp, views[v], v);
      sum +=
          std::polar(1.0 / static_cast<double>(views.size()), seen - sign * nominal_scale * joint);
    }
    if (std::abs(sum) <= best) continue;
    best = std::abs(sum);
    lamp.scale = sign * nominal_scale;
    lamp.offset = std::arg(sum);
  }
  constexpr double kOneRate = 0.99;  // of unit vectors: 8 deg rms about their mean
  if (best < kOneRate) {
    throw StepRefused(
        fmt::format("{}: the lamp's azimuth does not follow the arm's reading at {:.2f} "
                    "deg per degree: check its steps per turn, and that joints and "
                    "images belong together",
                    kLampStep, std::abs(nominal_scale)));
  }
  if (lamp.scale != nominal_scale) {
    notes.emplace_back("lamp_arm counts the other way round than the rig file says");
  }
  return lamp;
}

/// Searches from `lamp` and again from what was found, with the noise of the centres that the last
/// search has shown. With another, what the priors leave open would be scaled with it.
LeastSquaresSolution refine_lamp(const StageAxes& stage, const StageGeometry& geometry,
                                 std::span<const MirrorView> views, const MirrorMount& mount,
                                 const LampArmOptions& options, LampGeometry& lamp) {
  double u_pixel = options.u_pixel;
  for (int pass = 0;; ++pass) {
    LeastSquaresProblem problem;
    problem.components = 2;
    problem.sigma = u_pixel;
    // One centre per view cannot tell its own noise from that of the joints.
    problem.estimate_sigma = false;
    problem.global = Eigen::VectorXd::Zero(par::kCount + stage_parameter::kCount);
    problem.global_step.resize(problem.global.size());
    problem.global_step << lamp_steps(), stage_steps();
    problem.considered_covariance = stage.covariance;
    for (const MirrorView& view : views) {
      problem.blocks.push_back(
          mirror_block(stage, geometry, view, lamp, options.u_joint.radians()));
    }
    problem.blocks.push_back(mount_prior(lamp, mount));
    const LeastSquaresSolution solution = solve(problem);
    lamp = lamp.changed_by(solution.global.head(par::kCount));
    constexpr double kLeastNoise_px = 0.01;  // the joints' scatter may explain all that is seen
    constexpr double kSameNoise = 0.1;
    constexpr int kPasses = 10;
    const double seen = std::max(kLeastNoise_px, u_pixel * std::sqrt(solution.chi2_per_dof));
    const bool same = std::abs(seen / u_pixel - 1.0) < kSameNoise;
    if (pass > 0 && (same || pass >= kPasses)) return solution;
    u_pixel = seen;
  }
}

rig::RigDescription rig_with(const LampArm& lamp, const Eigen::VectorXd& errors) {
  rig::RigDescription rig = lamp.rig;
  store_lamp(lamp_geometry_of(rig).changed_by(errors), rig);
  return rig;
}

template <typename Quantity>
Eigen::MatrixXd lamp_covariance_of(const LampArm& lamp, const Quantity& quantity) {
  const Eigen::MatrixXd own = lamp.covariance.topLeftCorner(par::kCount, par::kCount);
  return propagated(
      [&](const Eigen::VectorXd& errors) -> Eigen::VectorXd {
        return quantity(lamp_geometry_of(rig_with(lamp, errors)));
      },
      own, lamp_steps());
}

}  // namespace

LampArm fit_lamp_arm(const StageAxes& stage, std::span<const MirrorView> views,
                     const MirrorMount& mount, const LampArmOptions& options) {
  if (!(options.u_pixel > 0.0) || !(mount.u_offset_mm > 0.0) || !(mount.u_tilt > Angle())) {
    throw std::invalid_argument("lamp arm: standard uncertainties must be above 0");
  }
  check_mirror_views(stage, views, options);
  LampArm result;
  result.rig = stage.rig;
  const StageGeometry geometry = geometry_of(stage);
  LampGeometry lamp = start_of_lamp(stage, geometry, views, mount, result.notes);
  LeastSquaresSolution solution;
  try {
    solution = refine_lamp(stage, geometry, views, mount, options, lamp);
  } catch (const NumericalError& error) {
    throw StepRefused(
        fmt::format("{}: the mirror views give no path ({}): mirror or lamp moved, or "
                    "take more, at more arm angles and mirror tilts",
                    kLampStep, error.what()));
  }
  double squares = 0.0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    result.residual_px.emplace_back(solution.residuals[v].head<2>());
    squares += result.residual_px.back().squaredNorm();
  }
  result.rms_px = std::sqrt(squares / static_cast<double>(views.size()));
  if (!(result.rms_px <= options.max_rms_px)) {
    throw StepRefused(
        fmt::format("{}: the mirror views fit with {:.2f} px rms, expected {:.2f} at "
                    "most: mirror or lamp moved, or the arm is no circle",
                    kLampStep, result.rms_px, options.max_rms_px));
  }
  store_lamp(lamp, result.rig);
  result.rig.validate();
  result.mirror_tilt_x = Angle::from_radians(lamp.mirror_tilt.x());
  result.mirror_tilt_y = Angle::from_radians(lamp.mirror_tilt.y());
  result.covariance = solution.covariance;
  return result;
}

DirectionEstimate lamp_direction(const LampArm& lamp, Angle reading) {
  const auto direction = [&](const LampGeometry& geometry) {
    return Eigen::VectorXd(geometry.lamp_at(reading.radians()).normalized());
  };
  return {direction(lamp_geometry_of(lamp.rig)), lamp_covariance_of(lamp, direction)};
}

Angle worst_direction_sigma(const LampArm& lamp) {
  Angle worst;
  for (const double arm_deg : {15.0, 60.0, 105.0, 150.0}) {
    worst = std::max(worst, lamp_direction(lamp, Angle::from_degrees(arm_deg)).sigma());
  }
  return worst;
}

std::vector<CalibratedRig> one_sigma_rigs(const StageAxes& stage, const LampArm& lamp) {
  // By way of the correlations: lengths in mm, angles in rad and pixels differ too much in size.
  const Eigen::VectorXd sigmas = lamp.covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  const Eigen::VectorXd scale =
      (sigmas.array() > 0.0).select(sigmas.cwiseInverse(), Eigen::VectorXd::Zero(sigmas.size()));
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> independent(
      scale.asDiagonal() * lamp.covariance * scale.asDiagonal());
  std::vector<CalibratedRig> rigs;
  for (Eigen::Index k = 0; k < sigmas.size(); ++k) {
    const double variance = independent.eigenvalues()[k];
    if (!(variance > 0.0)) continue;
    const Eigen::VectorXd errors =
        std::sqrt(variance) * sigmas.cwiseProduct(independent.eigenvectors().col(k));
    StageAxes moved = perturbed(stage, errors.tail(stage_parameter::kCount));
    moved.rig.lamp = rig_with(lamp, errors.head(par::kCount)).lamp;
    rigs.push_back({std::move(moved.rig), moved.camera});
  }
  return rigs;
}

LengthEstimate lamp_distance(const LampArm& lamp, Angle reading) {
  const auto distance = [&](const LampGeometry& geometry) {
    return Eigen::VectorXd(
        Eigen::VectorXd::Constant(1, geometry.lamp_at(reading.radians()).norm()));
  };
  return {distance(lamp_geometry_of(lamp.rig))[0],
          std::sqrt(lamp_covariance_of(lamp, distance)(0, 0))};
}

}  // namespace gonio::calibration::geometry
