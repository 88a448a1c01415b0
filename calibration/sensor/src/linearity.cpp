#include "gonio/calibration/sensor/linearity.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/errors/errors.h"
#include "weighted_fit.h"

namespace gonio::calibration::sensor {
namespace {

constexpr const char* kLinearityStep = "linearity";
constexpr double kLowest = 0.05;  // of saturation: the range of EMVA 1288
constexpr double kHighest = 0.95;
constexpr double kFullPixels = 0.001;

void require_ascending(std::span<const LevelStatistics> levels, const DarkLine& dark) {
  for (std::size_t k = 1; k < levels.size(); ++k) {
    const LevelStatistics& shorter = levels[k - 1];
    const LevelStatistics& longer = levels[k];
    if (!(longer.exposure_s > shorter.exposure_s)) {
      throw StepRefused(
          fmt::format("{}: exposure {} s follows {} s, expected rising exposures: sort the sweep, "
                      "each exposure "
                      "once",
                      kLinearityStep, longer.exposure_s, shorter.exposure_s));
    }
    if (longer.saturated_fraction > kFullPixels) continue;
    const double fall = (shorter.mean_dn.value - dark.at(shorter.exposure_s)) -
                        (longer.mean_dn.value - dark.at(longer.exposure_s));
    constexpr double kSigmas = 6.0;
    if (fall > kSigmas * std::hypot(shorter.mean_dn.sigma, longer.mean_dn.sigma)) {
      throw StepRefused(fmt::format(
          "{}: the signal falls by {:.1f} DN from {} to {} s, expected a rise: the lamp changed or "
          "the camera applied another exposure; take the sweep again",
          kLinearityStep, fall, shorter.exposure_s, longer.exposure_s));
    }
  }
}

struct SweepRow {
  double exposure_s = 0.0;
  double signal_dn = 0.0;
  double sigma_dn = 0.0;
};

WeightedFit fit_curve(const std::vector<SweepRow>& rows, double scale_dn, int terms) {
  const auto count = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd design(count, 2 + terms);
  Eigen::VectorXd signal(count);
  Eigen::VectorXd sigma(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const SweepRow& row = rows[static_cast<std::size_t>(k)];
    const double u = row.signal_dn / scale_dn;
    design(k, 0) = row.exposure_s;
    design(k, 1) = 1.0;
    design(k, 2) = -row.signal_dn * u;
    if (terms == 2) design(k, 3) = -row.signal_dn * u * u;
    signal[k] = row.signal_dn;
    sigma[k] = row.sigma_dn;
  }
  return weighted_fit(design, signal, sigma);
}

/// Line with the least relative deviations, as EMVA 1288 draws it.
WeightedFit fit_line(const std::vector<SweepRow>& rows) {
  const auto count = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Ones(count, 2);
  Eigen::VectorXd signal(count);
  for (Eigen::Index k = 0; k < count; ++k) {
    design(k, 0) = rows[static_cast<std::size_t>(k)].exposure_s;
    signal[k] = rows[static_cast<std::size_t>(k)].signal_dn;
  }
  return weighted_fit(design, signal, signal);
}

}  // namespace

Linearity fit_linearity(std::span<const LevelStatistics> dark,
                        std::span<const LevelStatistics> levels, const LinearityOptions& options) {
  if (options.correction_terms != 1 && options.correction_terms != 2) {
    throw std::invalid_argument(
        fmt::format("linearity: {} correction terms, expected 1 or 2", options.correction_terms));
  }
  const DarkLine black = dark_line(kLinearityStep, dark, options.saturation_dn);
  require_light(kLinearityStep, levels, black);
  require_ascending(levels, black);
  const double range = options.saturation_dn - black.offset_dn.value;

  Linearity result;
  std::vector<SweepRow> usable;
  std::vector<SweepRow> in_range;
  std::size_t saturated = 0;
  for (const LevelStatistics& level : levels) {
    LinearityPoint point;
    point.exposure_s = level.exposure_s;
    point.signal_dn = level.mean_dn.value - black.at(level.exposure_s);
    const double share = point.signal_dn / range;
    const bool full = level.saturated_fraction > kFullPixels || share > kHighest;
    if (full) ++saturated;
    const SweepRow row{level.exposure_s, point.signal_dn,
                       std::hypot(level.mean_dn.sigma, options.light_sigma * point.signal_dn)};
    if (!full && point.signal_dn > 0.0) usable.push_back(row);
    point.in_range = !full && share >= kLowest;
    if (point.in_range) in_range.push_back(row);
    result.points.push_back(point);
  }
  if (in_range.size() < options.min_levels) {
    throw StepRefused(
        fmt::format("{}: {} of {} levels lie between 5 and 95 % of saturation ({} saturated), "
                    "expected at least "
                    "{}: take more exposures there",
                    kLinearityStep, in_range.size(), levels.size(), saturated, options.min_levels));
  }

  WeightedFit line;
  WeightedFit bent;
  try {
    line = fit_line(in_range);
    bent = fit_curve(usable, range, options.correction_terms);
  } catch (const NumericalError&) {
    throw StepRefused(
        fmt::format("{}: the exposures do not tell offset and curve apart, expected "
                    "them spread from near dark to 95 % of saturation",
                    kLinearityStep));
  }
  const double rate = bent.parameters[0];
  const double offset = bent.parameters[1] / rate;
  if (!(rate > 0.0)) {
    throw StepRefused(
        fmt::format("{}: the signal grows by {:.3g} DN/s, expected more than 0: the "
                    "exposure has no effect",
                    kLinearityStep, rate));
  }
  result.curve.scale_dn = range;
  result.curve.c1 = bent.parameters[2];
  result.curve.c2 = options.correction_terms == 2 ? bent.parameters[3] : 0.0;
  result.chi2_per_dof = bent.chi2_per_dof();

  Eigen::MatrixXd covariance = bent.covariance * bent.widening();
  // The dark level is common to all signals: its error is one of the intercept.
  covariance(1, 1) += std::pow(black.offset_dn.sigma, 2.0);
  Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(4, covariance.rows());
  jacobian(0, 0) = 1.0;
  jacobian(1, 0) = -offset / rate;
  jacobian(1, 1) = 1.0 / rate;
  for (Eigen::Index k = 2; k < covariance.rows(); ++k) jacobian(k, k) = 1.0;
  result.covariance = jacobian * covariance * jacobian.transpose();
  result.rate_dn_per_s = {rate, std::sqrt(result.covariance(0, 0))};
  result.shutter_offset_s = {offset, std::sqrt(result.covariance(1, 1))};

  const auto count = static_cast<double>(in_range.size());
  for (LinearityPoint& point : result.points) {
    const double on_line = line.parameters[0] * point.exposure_s + line.parameters[1];
    const double expected = rate * (point.exposure_s + offset);
    point.deviation_percent = 100.0 * (point.signal_dn - on_line) / on_line;
    point.after_curve_percent =
        100.0 * (result.curve.linear_dn(point.signal_dn) - expected) / expected;
    if (!point.in_range) continue;
    result.le_percent += std::abs(point.deviation_percent) / count;
    result.after_curve_percent += std::abs(point.after_curve_percent) / count;
  }
  result.acceptance = {"linearity error (%)", options.max_le_percent, result.le_percent};
  return result;
}

}  // namespace gonio::calibration::sensor
