#include "gonio/calibration/geometry/zero_offsets.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "gonio/calibration/result/step_refused.h"
#include "half_slope.h"
#include "plane_pose.h"
#include "stage_geometry.h"

namespace gonio::calibration::geometry {
namespace {

void check_peaks(const char* step, const rig::RigDescription& rig, std::span<const Peak> peaks,
                 const PeakFitOptions& options) {
  require_la2_with_lamp(step, rig);
  if (peaks.size() < 2) {
    throw StepRefused(fmt::format("{}: {} peaks, expected at least 2: scan at another arm angle",
                                  step, peaks.size()));
  }
  Angle low = Angle::from_radians(HUGE_VAL);
  Angle high = -low;
  for (std::size_t k = 0; k < peaks.size(); ++k) {
    check_joints(step, fmt::format("peak {}", k), rig, peaks[k].joints);
    const bool good = peaks[k].slope.allFinite() && peaks[k].covariance.allFinite() &&
                      Eigen::LLT<Eigen::Matrix2d>(peaks[k].covariance).info() == Eigen::Success;
    if (!good) {
      throw StepRefused(
          fmt::format("{}: peak {} is no number or has no covariance: fit its scan "
                      "again",
                      step, k));
    }
    low = std::min(low, peaks[k].joints[rig.lamp.links[0].axis]);
    high = std::max(high, peaks[k].joints[rig.lamp.links[0].axis]);
  }
  if (high - low < options.min_arm_separation) {
    throw StepRefused(
        fmt::format("{}: the peaks lie within {:.1f} deg of the arm, expected {:.0f} "
                    "at least: scan at another arm angle",
                    step, (high - low).degrees(), options.min_arm_separation.degrees()));
  }
}

/// Weighted least squares of 0 = slope + design * x per peak, with prior variances of x (0: none).
struct PeakSystem {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;
  Eigen::VectorXd by_lamp;  // what a turn of the lamp's zero adds to `right`
  double degrees_of_freedom;

  explicit PeakSystem(Eigen::Index unknowns, std::size_t peaks)
      : normal(Eigen::MatrixXd::Zero(unknowns, unknowns)),
        right(Eigen::VectorXd::Zero(unknowns)),
        by_lamp(Eigen::VectorXd::Zero(unknowns)),
        degrees_of_freedom(2.0 * static_cast<double>(peaks) - 2.0) {}

  void add(const Peak& peak, const Eigen::MatrixXd& design, const Eigen::Vector2d& slope,
           const Eigen::Vector2d& slope_by_lamp) {
    const Eigen::Matrix2d weight = peak.covariance.inverse();
    normal += design.transpose() * weight * design;
    right -= design.transpose() * weight * slope;
    by_lamp -= design.transpose() * weight * slope_by_lamp;
  }

  /// Scatter beyond what the peaks say widens the covariance, luck does not narrow it.
  Eigen::MatrixXd covariance(double chi2_per_dof, double u_lamp) const {
    const Eigen::LDLT<Eigen::MatrixXd> factor(normal);
    const Eigen::MatrixXd own =
        factor.solve(Eigen::MatrixXd::Identity(normal.rows(), normal.cols()));
    const Eigen::VectorXd follows = factor.solve(by_lamp);
    return own * std::max(1.0, chi2_per_dof) + u_lamp * u_lamp * follows * follows.transpose();
  }
};

void require_agreement_of_peaks(const char* step, const std::vector<Eigen::Vector2d>& residuals,
                                Angle limit) {
  double squares = 0.0;
  for (const Eigen::Vector2d& residual : residuals) squares += residual.squaredNorm();
  const double components = 2.0 * static_cast<double>(residuals.size());
  const Angle rms = Angle::from_radians(std::sqrt(squares / components));
  if (rms <= limit) return;
  throw StepRefused(
      fmt::format("{}: the peaks at different arm angles contradict each other by "
                  "{:.3f} deg, expected {:.3f} at most: calibrate the lamp arm again, "
                  "or the sample is not flat",
                  step, rms.degrees(), limit.degrees()));
}

/// Derivative of a peak's slope by the offset of a link: that by its joint over the scale.
Eigen::Vector2d slope_by_offset(const rig::RigDescription& rig, const Peak& peak,
                                const rig::ChainLink& link, const PeakFitOptions& options) {
  return half_slope_by_joint(rig, peak.joints, options.point_in_sample_mm, link.axis) / link.scale;
}

}  // namespace

ZeroOffsets fit_zero_offsets(const rig::RigDescription& rig, std::span<const Peak> peaks,
                             Angle u_mount_tilt, const PeakFitOptions& options) {
  const char* const step = "zero offsets";
  check_peaks(step, rig, peaks, options);
  if (!(u_mount_tilt > Angle())) {
    throw std::invalid_argument("zero offsets: the mount's tilt must have an uncertainty above 0");
  }
  // Offsets of azimuth and tilt, slope of the mirror in its mount.
  const double mount_weight = 1.0 / (u_mount_tilt.radians() * u_mount_tilt.radians());
  ZeroOffsets result;
  result.rig = rig;
  Eigen::Vector2d mount = Eigen::Vector2d::Zero();
  rig::ChainLink& azimuth = result.rig.sample.links[0];
  rig::ChainLink& tilt = result.rig.sample.links[1];
  PeakSystem system(4, peaks.size());
  constexpr int kGaussNewtonSteps = 4;  // slopes are nearly linear in the offsets
  for (int iteration = 0; iteration < kGaussNewtonSteps; ++iteration) {
    system = PeakSystem(4, peaks.size());
    for (const Peak& peak : peaks) {
      const double way = peak.turned ? -1.0 : 1.0;
      Eigen::MatrixXd design(2, 4);
      design << slope_by_offset(result.rig, peak, azimuth, options),
          slope_by_offset(result.rig, peak, tilt, options), -way * Eigen::Matrix2d::Identity();
      const Eigen::Vector2d slope =
          half_slope(result.rig, peak.joints, options.point_in_sample_mm) - way * mount;
      system.add(peak, design, slope,
                 slope_by_offset(result.rig, peak, result.rig.lamp.links[0], options));
    }
    system.normal.bottomRightCorner<2, 2>().diagonal().array() += mount_weight;
    system.right.tail<2>() -= mount_weight * mount;
    const Eigen::VectorXd change = system.normal.ldlt().solve(system.right);
    azimuth.offset += Angle::from_radians(change[0]);
    tilt.offset += Angle::from_radians(change[1]);
    mount += change.tail<2>();
  }
  double chi2 = mount_weight * mount.squaredNorm();
  for (const Peak& peak : peaks) {
    const Eigen::Vector2d left = half_slope(result.rig, peak.joints, options.point_in_sample_mm) -
                                 (peak.turned ? -1.0 : 1.0) * mount;
    chi2 += left.dot(peak.covariance.inverse() * left);
    result.residuals.push_back(left);
  }
  require_agreement_of_peaks(step, result.residuals, options.max_disagreement);
  result.chi2_per_dof = chi2 / system.degrees_of_freedom;
  result.covariance =
      system.covariance(result.chi2_per_dof, options.u_lamp_zero.radians()).topLeftCorner<2, 2>();
  result.azimuth = azimuth.offset - rig.sample.links[0].offset;
  result.tilt = tilt.offset - rig.sample.links[1].offset;
  return result;
}

MountNormal fit_mount_normal(const rig::RigDescription& rig, std::span<const Peak> peaks,
                             const PeakFitOptions& options) {
  const char* const step = "mount normal";
  check_peaks(step, rig, peaks, options);
  PeakSystem system(2, peaks.size());
  for (const Peak& peak : peaks) {
    system.add(peak, -Eigen::Matrix2d::Identity(), peak.slope,
               slope_by_offset(rig, peak, rig.lamp.links[0], options));
  }
  const Eigen::Vector2d slope = system.normal.ldlt().solve(system.right);
  std::vector<Eigen::Vector2d> residuals;
  MountNormal normal;
  for (const Peak& peak : peaks) {
    residuals.emplace_back(peak.slope - slope);
    normal.chi2_per_dof += residuals.back().dot(peak.covariance.inverse() * residuals.back()) /
                           system.degrees_of_freedom;
  }
  require_agreement_of_peaks(step, residuals, options.max_disagreement);
  // The rotation vector that takes z to (slope, 1): across the slope.
  const double size = slope.norm();
  const double per_slope = size > 0.0 ? std::atan(size) / size : 1.0;
  normal.tilt_x = Angle::from_radians(-per_slope * slope.y());
  normal.tilt_y = Angle::from_radians(per_slope * slope.x());
  Eigen::Matrix2d turn;
  turn << 0.0, -1.0, 1.0, 0.0;
  normal.covariance = turn * system.covariance(normal.chi2_per_dof, options.u_lamp_zero.radians()) *
                      turn.transpose();
  return normal;
}

rig::RigDescription with_mount_normal(const rig::RigDescription& rig, const MountNormal& normal) {
  rig::RigDescription result = rig;
  result.sample.home_pose.linear() =
      rig.sample.home_pose.linear() *
      rotation_by({normal.tilt_x.radians(), normal.tilt_y.radians(), 0.0});
  return result;
}

}  // namespace gonio::calibration::geometry
