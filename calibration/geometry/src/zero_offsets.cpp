#include "gonio/calibration/geometry/zero_offsets.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
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

/// Weighted least squares of 0 = slope + design * x per peak.
struct PeakSystem {
  Eigen::MatrixXd normal;
  Eigen::VectorXd right;

  explicit PeakSystem(Eigen::Index unknowns)
      : normal(Eigen::MatrixXd::Zero(unknowns, unknowns)), right(Eigen::VectorXd::Zero(unknowns)) {}

  void add(const Peak& peak, const Eigen::MatrixXd& design, const Eigen::Vector2d& slope) {
    const Eigen::Matrix2d weight = peak.covariance.inverse();
    normal += design.transpose() * weight * design;
    right -= design.transpose() * weight * slope;
  }

  Eigen::VectorXd solution() const { return normal.ldlt().solve(right); }

  /// Scatter beyond what the peaks say widens the covariance, luck does not narrow it. Symmetric to
  /// the last digit, as files of it are read.
  Eigen::MatrixXd covariance(double chi2_per_dof) const {
    const Eigen::MatrixXd own =
        normal.ldlt().solve(Eigen::MatrixXd::Identity(normal.rows(), normal.cols()));
    return 0.5 * (own + own.transpose()) * std::max(1.0, chi2_per_dof);
  }
};

double degrees_of_freedom(std::span<const Peak> peaks) {
  return 2.0 * static_cast<double>(peaks.size()) - 2.0;
}

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

/// Zeros of azimuth and tilt with which all peaks lie where half vector and mirror say.
struct ZeroFit {
  rig::RigDescription rig;  ///< with them
  Eigen::Vector2d mount;    ///< slope of the mirror in its mount
  PeakSystem system;

  Eigen::Vector2d zeros() const {
    return {rig.sample.links[0].offset.radians(), rig.sample.links[1].offset.radians()};
  }
};

ZeroFit zeros_of(const rig::RigDescription& rig, std::span<const Peak> peaks, double mount_weight,
                 const PeakFitOptions& options) {
  ZeroFit fit{rig, Eigen::Vector2d::Zero(), PeakSystem(4)};
  rig::ChainLink& azimuth = fit.rig.sample.links[0];
  rig::ChainLink& tilt = fit.rig.sample.links[1];
  constexpr int kGaussNewtonSteps = 4;  // slopes are nearly linear in the offsets
  for (int iteration = 0; iteration < kGaussNewtonSteps; ++iteration) {
    fit.system = PeakSystem(4);
    for (const Peak& peak : peaks) {
      const double way = peak.turned ? -1.0 : 1.0;
      Eigen::MatrixXd design(2, 4);
      design << slope_by_offset(fit.rig, peak, azimuth, options),
          slope_by_offset(fit.rig, peak, tilt, options), -way * Eigen::Matrix2d::Identity();
      const Eigen::Vector2d slope =
          half_slope(fit.rig, peak.joints, options.point_in_sample_mm) - way * fit.mount;
      fit.system.add(peak, design, slope);
    }
    fit.system.normal.bottomRightCorner<2, 2>().diagonal().array() += mount_weight;
    fit.system.right.tail<2>() -= mount_weight * fit.mount;
    const Eigen::VectorXd change = fit.system.solution();
    azimuth.offset += Angle::from_radians(change[0]);
    tilt.offset += Angle::from_radians(change[1]);
    fit.mount += change.tail<2>();
  }
  return fit;
}

/// `found` with the zeros of azimuth and tilt off by one standard deviation, for each of two
/// independent errors.
std::vector<CalibratedRig> zeros_off(const CalibratedRig& found,
                                     const Eigen::Matrix2d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> independent(covariance);
  std::vector<CalibratedRig> rigs;
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Eigen::Vector2d error =
        std::sqrt(std::max(0.0, independent.eigenvalues()[k])) * independent.eigenvectors().col(k);
    rigs.push_back(found);
    auto& links = rigs.back().rig.sample.links;
    links[0].offset += Angle::from_radians(error[0]);
    links[1].offset += Angle::from_radians(error[1]);
  }
  return rigs;
}

}  // namespace

ZeroOffsets fit_zero_offsets(const CalibratedRig& found, std::span<const Peak> peaks,
                             Angle u_mount_tilt, const PeakFitOptions& options) {
  const rig::RigDescription& rig = found.rig;
  const char* const step = "zero offsets";
  check_peaks(step, rig, peaks, options);
  if (!(u_mount_tilt > Angle())) {
    throw std::invalid_argument("zero offsets: the mount's tilt must have an uncertainty above 0");
  }
  const double mount_weight = 1.0 / (u_mount_tilt.radians() * u_mount_tilt.radians());
  const ZeroFit fit = zeros_of(rig, peaks, mount_weight, options);
  ZeroOffsets result;
  result.rig = fit.rig;
  double chi2 = mount_weight * fit.mount.squaredNorm();
  for (const Peak& peak : peaks) {
    const Eigen::Vector2d left = half_slope(fit.rig, peak.joints, options.point_in_sample_mm) -
                                 (peak.turned ? -1.0 : 1.0) * fit.mount;
    chi2 += left.dot(peak.covariance.inverse() * left);
    result.residuals.push_back(left);
  }
  require_agreement_of_peaks(step, result.residuals, options.max_disagreement);
  result.chi2_per_dof = chi2 / degrees_of_freedom(peaks);
  result.covariance = fit.system.covariance(result.chi2_per_dof).topLeftCorner<2, 2>();
  const std::vector<CalibratedRig> own = zeros_off({fit.rig, found.camera}, result.covariance);
  for (const CalibratedRig& other : options.one_sigma_rigs) {
    const ZeroFit refitted = zeros_of(other.rig, peaks, mount_weight, options);
    const Eigen::Vector2d follows = refitted.zeros() - fit.zeros();
    result.covariance += follows * follows.transpose();
    result.one_sigma_rigs.push_back({refitted.rig, other.camera});
  }
  result.one_sigma_rigs.insert(result.one_sigma_rigs.end(), own.begin(), own.end());
  result.azimuth = fit.rig.sample.links[0].offset - rig.sample.links[0].offset;
  result.tilt = fit.rig.sample.links[1].offset - rig.sample.links[1].offset;
  return result;
}

MountNormal fit_mount_normal(const rig::RigDescription& rig, std::span<const Peak> peaks,
                             const PeakFitOptions& options) {
  const char* const step = "mount normal";
  check_peaks(step, rig, peaks, options);
  PeakSystem system(2);
  for (const Peak& peak : peaks) system.add(peak, -Eigen::Matrix2d::Identity(), peak.slope);
  const Eigen::Vector2d slope = system.solution();
  std::vector<Eigen::Vector2d> residuals;
  MountNormal normal;
  for (const Peak& peak : peaks) {
    residuals.emplace_back(peak.slope - slope);
    normal.chi2_per_dof += residuals.back().dot(peak.covariance.inverse() * residuals.back()) /
                           degrees_of_freedom(peaks);
  }
  require_agreement_of_peaks(step, residuals, options.max_disagreement);
  // The rotation vector that takes z to (slope, 1): across the slope.
  const double size = slope.norm();
  const double per_slope = size > 0.0 ? std::atan(size) / size : 1.0;
  normal.tilt_x = Angle::from_radians(-per_slope * slope.y());
  normal.tilt_y = Angle::from_radians(per_slope * slope.x());
  Eigen::Matrix2d turn;
  turn << 0.0, -1.0, 1.0, 0.0;
  normal.covariance = turn * system.covariance(normal.chi2_per_dof) * turn.transpose();
  return normal;
}

}  // namespace gonio::calibration::geometry
