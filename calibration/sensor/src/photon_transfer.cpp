#include "gonio/calibration/sensor/photon_transfer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/errors/errors.h"
#include "weighted_fit.h"

namespace gonio::calibration::sensor {
namespace {

constexpr const char* kTransferStep = "photon transfer";
constexpr double kQuantisation_dn2 = 1.0 / 12.0;
// EMVA 1288 R4.0: below it the variance of a rounded number no longer tells that before rounding.
constexpr double kHidden_dn2 = 0.24;
constexpr double kSaturatedPixels = 0.001;  // a level with more is not used for the fit

std::vector<LevelStatistics> by_mean(std::span<const LevelStatistics> levels) {
  std::vector<LevelStatistics> sorted(levels.begin(), levels.end());
  std::sort(sorted.begin(), sorted.end(), [](const LevelStatistics& a, const LevelStatistics& b) {
    return a.mean_dn.value < b.mean_dn.value;
  });
  return sorted;
}

struct Peak {
  std::size_t level = 0;
  bool reached = false;
};

/// The variance grows with the signal until pixels are full, then falls to nothing.
Peak variance_peak(const std::vector<LevelStatistics>& levels) {
  Peak peak;
  for (std::size_t k = 0; k < levels.size(); ++k) {
    if (levels[k].variance_dn2.value > levels[peak.level].variance_dn2.value) peak.level = k;
  }
  constexpr double kFallen = 0.8;  // far outside the noise of a variance over 256 pixels
  for (std::size_t k = peak.level + 1; k < levels.size(); ++k) {
    peak.reached = peak.reached ||
                   levels[k].variance_dn2.value < kFallen * levels[peak.level].variance_dn2.value;
  }
  if (!peak.reached) peak.level = levels.size() - 1;
  return peak;
}

/// A point with what the fit needs.
struct TransferPoint {
  double signal_dn = 0.0;
  double variance_dn2 = 0.0;
  double relative_sigma = 0.0;  ///< of the variance
};

TransferPoint linearised(const LevelStatistics& level, double black_dn,
                         const std::optional<instrument::ResponseCurve>& response) {
  TransferPoint point;
  point.signal_dn = level.mean_dn.value - black_dn;
  point.variance_dn2 = level.variance_dn2.value;
  if (response) {
    // Rounding comes after the bend: its share does not stretch.
    const double slope = response->slope(point.signal_dn);
    point.variance_dn2 =
        (point.variance_dn2 - kQuantisation_dn2) * slope * slope + kQuantisation_dn2;
    point.signal_dn = response->linear_dn(point.signal_dn);
  }
  const double normal = std::sqrt(2.0 / static_cast<double>(level.pixels));
  point.relative_sigma =
      level.variance_dn2.value > 0.0 && level.variance_dn2.sigma > 0.0
          ? std::max(0.5 * normal, level.variance_dn2.sigma / level.variance_dn2.value)
          : normal;
  return point;
}

WeightedFit fit_variance(const std::vector<TransferPoint>& points, bool curved) {
  const auto rows = static_cast<Eigen::Index>(points.size());
  Eigen::MatrixXd design(rows, curved ? 3 : 2);
  Eigen::VectorXd variance(rows);
  Eigen::VectorXd relative(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const TransferPoint& point = points[static_cast<std::size_t>(k)];
    design(k, 0) = 1.0;
    design(k, 1) = point.signal_dn;
    if (curved) design(k, 2) = point.signal_dn * point.signal_dn;
    variance[k] = point.variance_dn2;
    relative[k] = point.relative_sigma;
  }
  // Weights from the fit: from the data, a variance that came out small would weigh more.
  constexpr int kRounds = 4;
  constexpr double kFloor_dn2 = 1e-3;
  Eigen::VectorXd expected = variance;
  WeightedFit fit;
  for (int round = 0; round < kRounds; ++round) {
    fit = weighted_fit(design, variance, relative.cwiseProduct(expected.cwiseMax(kFloor_dn2)));
    expected = fit.fitted;
  }
  return fit;
}

double light_noise_of(std::span<const LevelStatistics> levels, double black_dn, double range_dn) {
  constexpr double kBright = 0.05;  // below it shot noise of the mean is all there is
  double sum = 0.0;
  double count = 0.0;
  for (const LevelStatistics& level : levels) {
    const double signal = level.mean_dn.value - black_dn;
    if (signal < kBright * range_dn || level.saturated_fraction > kSaturatedPixels) continue;
    const double shot = 4.0 * std::pow(level.mean_dn.sigma, 2.0);  // of a difference of frames
    sum += (std::pow(level.mean_difference_dn, 2.0) - shot) / (signal * signal);
    count += 1.0;
  }
  return count > 0.0 ? std::sqrt(std::max(0.0, sum / count)) : 0.0;
}

void fill_capacity(PhotonTransfer& result, const std::vector<LevelStatistics>& levels,
                   const Peak& peak, const PhotonTransferOptions& options, const WeightedFit& fit) {
  const double gain = result.gain_dn_per_e.value;
  const double relative_gain = result.gain_dn_per_e.sigma / gain;
  const double black = result.black_level_dn.value;
  const double top = levels[peak.level].mean_dn.value;
  const double below = peak.level > 0 ? levels[peak.level - 1].mean_dn.value : black;
  const double spacing = (top - below) / std::sqrt(6.0);  // the peak lies within one spacing of it
  result.saturation_reached = peak.reached;
  result.saturation_dn = {top, spacing};
  const double saturation_e =
      linearised(levels[peak.level], black, options.response).signal_dn / gain;
  result.saturation_e = {saturation_e,
                         saturation_e * std::hypot(relative_gain, spacing / (top - black))};

  constexpr double kCollapsed = 0.25;  // of what shot noise would make of the signal
  for (std::size_t k = peak.level + 1; k < levels.size() && peak.reached; ++k) {
    const TransferPoint point = linearised(levels[k], black, options.response);
    const double shot = fit.parameters[0] + gain * point.signal_dn;
    if (levels[k].variance_dn2.value > kCollapsed * shot) continue;
    const double full_e = point.signal_dn / gain;
    if (!result.full_well_e || full_e > result.full_well_e->value) {
      result.full_well_e = Estimate{full_e, full_e * relative_gain};
    }
  }

  const double dark_variance = result.read_noise_is_bound ? kHidden_dn2 : fit.parameters[0];
  const double dark_sigma_dn = std::sqrt(dark_variance);
  const double variance_sigma = std::sqrt(fit.covariance(0, 0) * fit.widening());
  const double threshold = dark_sigma_dn / gain + 0.5;
  result.threshold_e = {threshold, std::hypot(variance_sigma / (2.0 * dark_sigma_dn * gain),
                                              dark_sigma_dn / gain * relative_gain)};
  const double snr = std::sqrt(saturation_e);
  result.snr_max = {snr, 0.5 * result.saturation_e.sigma / snr};
  const double range = saturation_e / threshold;
  // Both are divided by the gain, whose error they share: leaving that out errs on the safe side.
  result.dynamic_range = {range, range * std::hypot(result.saturation_e.sigma / saturation_e,
                                                    result.threshold_e.sigma / threshold)};
}

void fill_noise(PhotonTransfer& result, const WeightedFit& fit) {
  const double gain = fit.parameters[1];
  const double widening = fit.widening();
  const double gain_variance = fit.covariance(1, 1) * widening;
  // The black level's own error shifts every signal and so, through the slope, v0.
  const double v0_variance =
      fit.covariance(0, 0) * widening + std::pow(gain * result.black_level_dn.sigma, 2.0);
  result.gain_dn_per_e = {gain, std::sqrt(gain_variance)};
  result.read_noise_is_bound = fit.parameters[0] < kHidden_dn2;
  const double noise_dn =
      std::sqrt((result.read_noise_is_bound ? kHidden_dn2 : fit.parameters[0]) - kQuantisation_dn2);
  const double by_v0 = 1.0 / (2.0 * noise_dn * gain);
  const double by_gain = -noise_dn / (gain * gain);
  const double cross = fit.covariance(0, 1) * widening;
  const double variance = by_v0 * by_v0 * v0_variance + by_gain * by_gain * gain_variance +
                          2.0 * by_v0 * by_gain * cross;
  result.read_noise_e = {noise_dn / gain, std::sqrt(variance)};
  result.covariance << gain_variance, by_v0 * cross + by_gain * gain_variance,
      by_v0 * cross + by_gain * gain_variance, variance;
}

}  // namespace

PhotonTransfer fit_photon_transfer(std::span<const LevelStatistics> dark,
                                   std::span<const LevelStatistics> levels,
                                   const PhotonTransferOptions& options) {
  const DarkLine black = dark_line(kTransferStep, dark, options.saturation_dn);
  require_light(kTransferStep, levels, black);
  const std::vector<LevelStatistics> sorted = by_mean(levels);
  const Peak peak = variance_peak(sorted);

  PhotonTransfer result;
  result.black_level_dn = black.offset_dn;
  result.dark_rate_dn_per_s = black.rate_dn_per_s;
  const double zero = black.offset_dn.value;
  const double range =
      (peak.reached ? sorted[peak.level].mean_dn.value : options.saturation_dn) - zero;
  constexpr double kReach = 0.5;  // less does not tell shot noise from anything else
  if (const double highest = sorted.back().mean_dn.value - zero; highest < kReach * range) {
    throw StepRefused(fmt::format(
        "{}: the brightest level is at {:.0f} % of saturation, expected {:.0f} % at least: expose "
        "longer",
        kTransferStep, 100.0 * highest / range, 100.0 * kReach));
  }

  std::vector<TransferPoint> used;
  const auto add = [&](const LevelStatistics& level, bool use) {
    const TransferPoint point = linearised(level, zero, options.response);
    result.points.push_back({level.exposure_s, point.signal_dn, point.variance_dn2, 0.0, use});
    if (use) used.push_back(point);
  };
  for (const LevelStatistics& level : dark) add(level, true);
  std::size_t in_range = 0;
  for (const LevelStatistics& level : sorted) {
    const double signal = level.mean_dn.value - zero;
    const bool use = signal > 0.0 && signal <= options.fit_limit * range &&
                     level.saturated_fraction <= kSaturatedPixels;
    if (use) ++in_range;
    add(level, use);
  }
  if (in_range < options.min_levels) {
    throw StepRefused(fmt::format(
        "{}: {} of {} levels lie between dark and {:.0f} % of saturation, expected at least {}: "
        "take "
        "more levels there, shorter exposures or less light",
        kTransferStep, in_range, levels.size(), 100.0 * options.fit_limit, options.min_levels));
  }

  WeightedFit fit;
  try {
    fit = fit_variance(used, options.curved);
  } catch (const NumericalError&) {
    throw StepRefused(
        fmt::format("{}: the levels do not tell a slope, expected them spread from "
                    "dark to {:.0f} % of saturation: vary the exposure more",
                    kTransferStep, 100.0 * options.fit_limit));
  }
  const double slope_sigma = std::sqrt(fit.covariance(1, 1) * fit.widening());
  constexpr double kSignificant = 5.0;
  if (!(fit.parameters[1] > kSignificant * slope_sigma)) {
    throw StepRefused(fmt::format(
        "{}: the variance grows by {:.3g} +- {:.2g} DN^2 per DN, expected a clear slope: these are "
        "not raw frames (denoised, averaged), or the levels are too alike",
        kTransferStep, fit.parameters[1], slope_sigma));
  }
  result.chi2_per_dof = fit.chi2_per_dof();
  for (PhotonTransferPoint& point : result.points) {
    point.fitted_dn2 = fit.parameters[0] + fit.parameters[1] * point.signal_dn;
    if (options.curved) point.fitted_dn2 += fit.parameters[2] * point.signal_dn * point.signal_dn;
  }
  fill_noise(result, fit);
  fill_capacity(result, sorted, peak, options, fit);
  result.light_noise = light_noise_of(levels, zero, range);
  return result;
}

}  // namespace gonio::calibration::sensor
