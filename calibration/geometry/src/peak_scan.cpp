#include "gonio/calibration/geometry/peak_scan.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/rig/kinematics.h"
#include "half_slope.h"
#include "stage_geometry.h"

namespace gonio::calibration::geometry {
namespace {

const char* const kPeakStep = "peak scan";

using Coefficients = Eigen::Matrix<double, 6, 1>;  // 1 x y xx xy yy

/// One sample as the fit sees it.
struct SlopeSample {
  Eigen::Vector2d slope;
  double log_signal;
  double variance;                  // of log_signal by the signal alone
  Eigen::Matrix2d slope_by_joints;  // columns azimuth, tilt
};

std::size_t arm_axis(const rig::RigDescription& rig) { return rig.lamp.links[0].axis; }
std::size_t azimuth_axis(const rig::RigDescription& rig) { return rig.sample.links[0].axis; }
std::size_t tilt_axis(const rig::RigDescription& rig) { return rig.sample.links[1].axis; }

void check_scan(const rig::RigDescription& rig, std::span<const PeakSample> scan) {
  constexpr double kArmStands_rad = 1e-3;
  for (std::size_t k = 0; k < scan.size(); ++k) {
    check_joints(kPeakStep, fmt::format("sample {}", k), rig, scan[k].joints);
    const Angle arm = scan[k].joints[arm_axis(rig)] - scan[0].joints[arm_axis(rig)];
    if (std::abs(arm.radians()) > kArmStands_rad) {
      throw StepRefused(
          fmt::format("{}: the lamp arm moves by {:.2f} deg within the scan, expected "
                      "it to stand: one scan per arm angle",
                      kPeakStep, arm.degrees()));
    }
    const bool good =
        std::isfinite(scan[k].signal) && std::isfinite(scan[k].sigma) && scan[k].sigma > 0.0;
    if (!good) {
      throw StepRefused(
          fmt::format("{}: sample {} has the signal {} +- {}, expected a number and "
                      "an uncertainty above 0",
                      kPeakStep, k, scan[k].signal, scan[k].sigma));
    }
  }
}

std::vector<SlopeSample> bright_samples(const rig::RigDescription& rig,
                                        std::span<const PeakSample> scan,
                                        const PeakOptions& options) {
  double brightest = 0.0;
  for (const PeakSample& sample : scan) brightest = std::max(brightest, sample.signal);
  std::vector<SlopeSample> bright;
  for (const PeakSample& sample : scan) {
    if (!(sample.signal > 0.0) || sample.signal < options.min_fraction * brightest) continue;
    const rig::RigPose pose = rig::forward(rig, sample.joints);
    const auto pair = pose.directions_at(options.point_in_sample_mm);
    const Eigen::Vector2d slope = half_slope(rig, sample.joints, options.point_in_sample_mm);
    if (!slope.allFinite() || !(pair.wo.z() > 0.0)) continue;
    const Eigen::Vector3d point = pose.world_from_sample * options.point_in_sample_mm;
    const double r2 =
        rig.collimated_lamp ? 1.0 : (pose.world_from_lamp.translation() - point).squaredNorm();
    SlopeSample result;
    result.slope = slope;
    result.log_signal = std::log(sample.signal * r2 * pair.wo.z());
    result.variance = std::pow(sample.sigma / sample.signal, 2);
    result.slope_by_joints.col(0) =
        half_slope_by_joint(rig, sample.joints, options.point_in_sample_mm, azimuth_axis(rig));
    result.slope_by_joints.col(1) =
        half_slope_by_joint(rig, sample.joints, options.point_in_sample_mm, tilt_axis(rig));
    bright.push_back(result);
  }
  if (bright.size() < options.min_samples) {
    throw StepRefused(fmt::format(
        "{}: {} of {} samples are brighter than {:.0f} % of the brightest, "
        "expected at least {}: centre the scan on the highlight or take "
        "finer steps",
        kPeakStep, bright.size(), scan.size(), 100.0 * options.min_fraction, options.min_samples));
  }
  return bright;
}

/// The lobe over slopes (x, y) = (slope - centre) / scale: L = ln(signal) less that of the
/// brightest sample, or (e^(power L) - 1) / power.
struct Paraboloid {
  double power = 0.0;
  Eigen::Vector2d centre;
  double scale = 1.0;
  Coefficients c = Coefficients::Zero();
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
  double chi2_per_dof = 0.0;
  double rms = 0.0;

  Eigen::Vector2d scaled(const Eigen::Vector2d& slope) const { return (slope - centre) / scale; }
  Eigen::Matrix2d curvature() const {
    Eigen::Matrix2d h;
    h << 2.0 * c[3], c[4], c[4], 2.0 * c[5];
    return h;
  }
  /// Per slope.
  Eigen::Vector2d gradient_at(const Eigen::Vector2d& slope) const {
    return (Eigen::Vector2d(c[1], c[2]) + curvature() * scaled(slope)) / scale;
  }
};

/// One weighted fit; the weights count the joints' scatter by the gradient of the last fit.
void fit_paraboloid(const std::vector<SlopeSample>& samples, double u_joint, Paraboloid& fit) {
  const auto count = static_cast<Eigen::Index>(samples.size());
  double top = samples[0].log_signal;
  for (const SlopeSample& sample : samples) top = std::max(top, sample.log_signal);
  Eigen::MatrixXd design(count, 6);
  Eigen::VectorXd right(count);
  Eigen::VectorXd weight(count);
  Eigen::VectorXd by_log(count);  // derivative of `right`
  for (Eigen::Index k = 0; k < count; ++k) {
    const SlopeSample& sample = samples[static_cast<std::size_t>(k)];
    const Eigen::Vector2d at = fit.scaled(sample.slope);
    const Eigen::Vector2d by_joints =
        sample.slope_by_joints.transpose() * fit.gradient_at(sample.slope);
    const double level = sample.log_signal - top;
    by_log[k] = std::exp(fit.power * level);
    right[k] = fit.power == 0.0 ? level : std::expm1(fit.power * level) / fit.power;
    weight[k] = 1.0 / std::sqrt(by_log[k] * by_log[k] * sample.variance +
                                u_joint * u_joint * by_joints.squaredNorm());
    design.row(k) << 1.0, at.x(), at.y(), at.x() * at.x(), at.x() * at.y(), at.y() * at.y();
  }
  const Eigen::MatrixXd weighted = weight.asDiagonal() * design;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(weighted);
  constexpr double kOnALine = 1e-6;
  const Eigen::VectorXd diagonal = qr.matrixR().diagonal().cwiseAbs();
  if (!(diagonal.minCoeff() > kOnALine * diagonal.maxCoeff())) {
    throw StepRefused(
        fmt::format("{}: the {} bright samples lie on a line or point, expected a grid of "
                    "azimuth and tilt",
                    kPeakStep, samples.size()));
  }
  fit.c = qr.solve(weight.cwiseProduct(right));
  const Eigen::VectorXd residual = right - design * fit.c;
  fit.rms = std::sqrt(residual.cwiseQuotient(by_log).squaredNorm() / static_cast<double>(count));
  constexpr double kParameters = 7.0;  // six coefficients and the power
  fit.chi2_per_dof =
      weight.cwiseProduct(residual).squaredNorm() / (static_cast<double>(count) - kParameters);
  fit.covariance = (weighted.transpose() * weighted).inverse() * fit.chi2_per_dof;
}

/// The paraboloid with the power that suits the lobe's tails best.
Paraboloid best_paraboloid(const std::vector<SlopeSample>& samples, double u_joint) {
  Paraboloid start;
  start.centre.setZero();
  for (const SlopeSample& sample : samples) start.centre += sample.slope;
  start.centre /= static_cast<double>(samples.size());
  double spread = 0.0;
  for (const SlopeSample& sample : samples) spread += (sample.slope - start.centre).squaredNorm();
  if (spread > 0.0) start.scale = std::sqrt(spread / static_cast<double>(samples.size()));
  Paraboloid best;
  for (int eighths = 0; eighths <= 8; ++eighths) {
    Paraboloid fit = start;
    fit.power = -eighths / 8.0;
    for (int pass = 0; pass < 3; ++pass) fit_paraboloid(samples, u_joint, fit);
    if (eighths == 0 || fit.chi2_per_dof < best.chi2_per_dof) best = fit;
  }
  return best;
}

/// Readings of azimuth and tilt at which the half vector has a slope, by Newton.
rig::Joints joints_at(const rig::RigDescription& rig, const Eigen::Vector2d& slope,
                      rig::Joints joints, const Eigen::Vector3d& point) {
  for (int iteration = 0; iteration < 10; ++iteration) {
    Eigen::Matrix2d jacobian;
    jacobian << half_slope_by_joint(rig, joints, point, azimuth_axis(rig)),
        half_slope_by_joint(rig, joints, point, tilt_axis(rig));
    const Eigen::Vector2d step = jacobian.fullPivLu().solve(slope - half_slope(rig, joints, point));
    joints[azimuth_axis(rig)] += Angle::from_radians(step[0]);
    joints[tilt_axis(rig)] += Angle::from_radians(step[1]);
  }
  return joints;
}

void require_inside(const rig::RigDescription& rig, std::span<const PeakSample> scan,
                    const rig::Joints& peak) {
  constexpr double kMargin = 0.15;  // of the range scanned
  for (const std::size_t axis : {azimuth_axis(rig), tilt_axis(rig)}) {
    Angle low = scan[0].joints[axis];
    Angle high = low;
    for (const PeakSample& sample : scan) {
      low = std::min(low, sample.joints[axis]);
      high = std::max(high, sample.joints[axis]);
    }
    const Angle margin = kMargin * (high - low);
    if (peak[axis] >= low + margin && peak[axis] <= high - margin) continue;
    throw StepRefused(
        fmt::format("{}: the peak lies at the edge of the scan: centre it on azimuth "
                    "{:.2f} deg, tilt {:.2f} deg",
                    kPeakStep, peak[azimuth_axis(rig)].degrees(), peak[tilt_axis(rig)].degrees()));
  }
}

}  // namespace

Eigen::Vector2d half_slope(const rig::RigDescription& rig, const rig::Joints& joints,
                           const Eigen::Vector3d& point_in_sample_mm) {
  const auto pair = rig::forward(rig, joints).directions_at(point_in_sample_mm);
  const Eigen::Vector3d half = pair.wi + pair.wo;
  if (!(half.z() > 0.0)) {
    return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  }
  return half.head<2>() / half.z();
}

Eigen::Vector2d half_slope_by_joint(const rig::RigDescription& rig, const rig::Joints& joints,
                                    const Eigen::Vector3d& point_in_sample_mm, std::size_t axis) {
  constexpr double kStep_rad = 1e-5;
  rig::Joints moved = joints;
  moved[axis] = joints[axis] + Angle::from_radians(kStep_rad);
  const Eigen::Vector2d above = half_slope(rig, moved, point_in_sample_mm);
  moved[axis] = joints[axis] - Angle::from_radians(kStep_rad);
  return (above - half_slope(rig, moved, point_in_sample_mm)) / (2.0 * kStep_rad);
}

void require_la2_with_lamp(const char* step, const rig::RigDescription& rig) {
  require_la2(step, rig);
  if (rig.lamp.links.size() == 1 && rig.lamp.links[0].lead_mm_per_turn == 0.0) return;
  throw StepRefused(fmt::format("{}: the rig \"{}\" has no lamp on one arm", step, rig.name));
}

Peak fit_peak(const rig::RigDescription& rig, std::span<const PeakSample> scan,
              const PeakOptions& options) {
  require_la2_with_lamp(kPeakStep, rig);
  check_scan(rig, scan);
  const std::vector<SlopeSample> samples = bright_samples(rig, scan, options);

  const Paraboloid fit = best_paraboloid(samples, options.u_joint.radians());
  const Eigen::Matrix2d curvature = fit.curvature();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(curvature);
  if (!(eigen.eigenvalues().maxCoeff() < 0.0)) {
    throw StepRefused(
        fmt::format("{}: the signal has no maximum in the scan: centre the scan on the "
                    "highlight, or the sample has none",
                    kPeakStep));
  }
  const Eigen::Matrix2d inverse = curvature.inverse();
  const Eigen::Vector2d top = -inverse * Eigen::Vector2d(fit.c[1], fit.c[2]);
  Peak peak;
  peak.slope = fit.centre + fit.scale * top;
  const auto brightest = std::max_element(
      scan.begin(), scan.end(),
      [](const PeakSample& a, const PeakSample& b) { return a.signal < b.signal; });
  peak.joints = joints_at(rig, peak.slope, brightest->joints, options.point_in_sample_mm);
  require_inside(rig, scan, peak.joints);
  if (!(fit.rms <= options.max_rms_log)) {
    throw StepRefused(
        fmt::format("{}: ln(signal) scatters by {:.2f} about a single peak, expected "
                    "{:.2f} at most: a second highlight or a dirty sample",
                    kPeakStep, fit.rms, options.max_rms_log));
  }

  // top = -H^-1 g: its change with each coefficient.
  Eigen::Matrix<double, 2, 6> by_coefficient;
  by_coefficient << Eigen::Vector2d::Zero(), Eigen::Vector2d(1.0, 0.0), Eigen::Vector2d(0.0, 1.0),
      Eigen::Vector2d(2.0 * top.x(), 0.0), Eigen::Vector2d(top.y(), top.x()),
      Eigen::Vector2d(0.0, 2.0 * top.y());
  by_coefficient = (-inverse * by_coefficient).eval();
  peak.covariance =
      fit.scale * fit.scale * by_coefficient * fit.covariance * by_coefficient.transpose();
  // The arm stands off its reading by the same amount for the whole scan.
  const Eigen::Vector2d by_arm =
      half_slope_by_joint(rig, peak.joints, options.point_in_sample_mm, arm_axis(rig));
  const double u_joint = options.u_joint.radians();
  peak.covariance += u_joint * u_joint * by_arm * by_arm.transpose();
  peak.chi2_per_dof = fit.chi2_per_dof;
  return peak;
}

}  // namespace gonio::calibration::geometry
