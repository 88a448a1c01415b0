#include "gonio/calibration/sensor/lamp_stability.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"
#include "weighted_fit.h"

namespace gonio::calibration::sensor {
namespace {

constexpr const char* kLampStep = "lamp warm-up";
constexpr double kTenMinutes_s = 600.0;

void check_readings(std::span<const LampReading> readings) {
  constexpr std::size_t kFewest = 20;
  constexpr double kShortest_s = 1200.0;
  if (readings.size() < kFewest) {
    throw StepRefused(fmt::format("{}: {} readings, expected at least {}: record longer", kLampStep,
                                  readings.size(), kFewest));
  }
  for (std::size_t k = 0; k < readings.size(); ++k) {
    if (!(readings[k].value > 0.0) || !std::isfinite(readings[k].value)) {
      throw StepRefused(
          fmt::format("{}: reading {} is {}, expected above 0: the lamp is off or the "
                      "shutter closed",
                      kLampStep, k, readings[k].value));
    }
    const bool rises = k == 0 || readings[k].time_s > readings[k - 1].time_s;
    if (!rises || !std::isfinite(readings[k].time_s) || readings[k].time_s < 0.0) {
      throw StepRefused(
          fmt::format("{}: reading {} is at {} s, expected rising times from 0 on: "
                      "the clock was set",
                      kLampStep, k, readings[k].time_s));
    }
  }
  const double span = readings.back().time_s - readings.front().time_s;
  if (span < kShortest_s) {
    throw StepRefused(
        fmt::format("{}: readings over {:.0f} s, expected at least {:.0f}: record "
                    "longer",
                    kLampStep, span, kShortest_s));
  }
}

/// For a given tau the rest is linear: value = level - loss exp(-t / tau).
WeightedFit fit_at(std::span<const LampReading> readings, double tau_s) {
  const auto rows = static_cast<Eigen::Index>(readings.size());
  Eigen::MatrixXd design(rows, 2);
  Eigen::VectorXd value(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const LampReading& reading = readings[static_cast<std::size_t>(k)];
    design(k, 0) = 1.0;
    design(k, 1) = -std::exp(-reading.time_s / tau_s);
    value[k] = reading.value;
  }
  return weighted_fit(design, value, Eigen::VectorXd::Ones(rows));
}

/// Least squares over tau: a grid in its logarithm, then golden section between its neighbours.
double best_tau(std::span<const LampReading> readings) {
  const double span = readings.back().time_s - readings.front().time_s;
  const double low = std::log(std::max(span / 100.0, readings.front().time_s / 10.0));
  const double high = std::log(10.0 * span);
  constexpr int kGrid = 48;
  const auto chi2 = [&](double log_tau) { return fit_at(readings, std::exp(log_tau)).chi2; };
  const double step = (high - low) / kGrid;
  double best = low;
  double least = chi2(low);
  for (int k = 1; k <= kGrid; ++k) {
    const double found = chi2(low + k * step);
    if (found < least) {
      least = found;
      best = low + k * step;
    }
  }
  double left = best - step;
  double right = best + step;
  constexpr double kGolden = 0.6180339887498949;
  constexpr int kRounds = 40;  // the interval shrinks to 1e-9 of itself
  for (int round = 0; round < kRounds; ++round) {
    const double a = right - kGolden * (right - left);
    const double b = left + kGolden * (right - left);
    (chi2(a) < chi2(b) ? right : left) = chi2(a) < chi2(b) ? b : a;
  }
  return std::exp(0.5 * (left + right));
}

/// Readings per independent one, from the autocorrelation of the residuals up to where it is lost
/// in its own noise.
double correlation_of(const Eigen::VectorXd& residual) {
  const Eigen::Index count = residual.size();
  const double power = residual.squaredNorm();
  if (!(power > 0.0)) return 1.0;
  const double lost = 2.0 / std::sqrt(static_cast<double>(count));
  double sum = 1.0;
  for (Eigen::Index lag = 1; lag < count / 2; ++lag) {
    const double share = residual.head(count - lag).dot(residual.tail(count - lag)) / power;
    if (share < lost) break;
    sum += 2.0 * share;
  }
  return sum;
}

struct Slope {
  double per_s = 0.0;
  double sigma = 0.0;
  double mean = 0.0;
};

Slope final_slope(std::span<const LampReading> readings, double correlation) {
  const double span = readings.back().time_s - readings.front().time_s;
  const double begin = readings.back().time_s - std::max(kTenMinutes_s, span / 6.0);
  constexpr std::size_t kFewest = 5;
  std::size_t first = 0;
  while (readings[first].time_s < begin && readings.size() - first > kFewest) ++first;
  const auto rows = static_cast<Eigen::Index>(readings.size() - first);
  Eigen::MatrixXd design = Eigen::MatrixXd::Ones(rows, 2);
  Eigen::VectorXd value(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const LampReading& reading = readings[first + static_cast<std::size_t>(k)];
    design(k, 1) = reading.time_s - readings.back().time_s;
    value[k] = reading.value;
  }
  const WeightedFit fit = weighted_fit(design, value, Eigen::VectorXd::Ones(rows));
  return {fit.parameters[1], std::sqrt(fit.covariance(1, 1) * fit.chi2_per_dof() * correlation),
          value.mean()};
}

/// Covariance of level, amplitude and tau about the solution, for readings of variance 1.
Eigen::Matrix3d unit_covariance(std::span<const LampReading> readings, double level,
                                double amplitude, double tau) {
  const auto rows = static_cast<Eigen::Index>(readings.size());
  Eigen::MatrixXd jacobian(rows, 3);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const double t = readings[static_cast<std::size_t>(k)].time_s;
    const double decay = std::exp(-t / tau);
    jacobian(k, 0) = 1.0 - amplitude * decay;
    jacobian(k, 1) = -level * decay;
    jacobian(k, 2) = -level * amplitude * decay * t / (tau * tau);
  }
  return weighted_fit(jacobian, Eigen::VectorXd::Zero(rows), Eigen::VectorXd::Ones(rows))
      .covariance;
}

}  // namespace

LampStability fit_lamp_stability(std::span<const LampReading> readings,
                                 const LampOptions& options) {
  check_readings(readings);
  const auto count = static_cast<double>(readings.size());
  const double limit = options.max_drift_per_10_min;
  LampStability result;

  const double tau = best_tau(readings);
  const WeightedFit fit = fit_at(readings, tau);
  const double level = fit.parameters[0];
  const double amplitude = fit.parameters[1] / level;
  Eigen::VectorXd value(fit.fitted.size());
  for (Eigen::Index k = 0; k < value.size(); ++k) {
    value[k] = readings[static_cast<std::size_t>(k)].value;
  }
  const Eigen::VectorXd residual = value - fit.fitted;
  const double variance = residual.squaredNorm() / (count - 3.0);
  result.correlation = correlation_of(residual);
  const double loss_sigma = std::sqrt(fit.covariance(1, 1) * variance * result.correlation);

  // What the lamp would gain in ten minutes from the first reading on, by this fit.
  const double in_ten_minutes = 1.0 - std::exp(-kTenMinutes_s / tau);
  const double first_gain =
      std::abs(amplitude) * std::exp(-readings.front().time_s / tau) * in_ten_minutes;
  constexpr double kSignificant = 5.0;  // tau was searched for: 3 sigma come by chance
  result.already_warm =
      first_gain < limit || std::abs(fit.parameters[1]) < kSignificant * loss_sigma;
  const double mean = value.mean();
  if (result.already_warm) {
    const Eigen::VectorXd about = (value.array() - mean).matrix();
    const double spread = about.squaredNorm() / (count - 1.0);
    result.correlation = correlation_of(about);
    result.sigma = std::sqrt(spread) / mean;
    result.level = {mean, std::sqrt(spread * result.correlation / count)};
    result.amplitude = {0.0, loss_sigma / mean};
    result.covariance.setZero();
    result.covariance(0, 0) = result.level.sigma * result.level.sigma;
    result.covariance(1, 1) = result.amplitude.sigma * result.amplitude.sigma;
  } else {
    const double span = readings.back().time_s - readings.front().time_s;
    if (tau > span || !(level > 0.0)) {
      throw StepRefused(fmt::format(
          "{}: after {:.0f} s the lamp still changes with a time constant of {:.0f} s, expected a "
          "record longer than that: record longer",
          kLampStep, readings.back().time_s, tau));
    }
    result.covariance =
        unit_covariance(readings, level, amplitude, tau) * variance * result.correlation;
    result.level = {level, std::sqrt(result.covariance(0, 0))};
    result.amplitude = {amplitude, std::sqrt(result.covariance(1, 1))};
    result.tau_s = {tau, std::sqrt(result.covariance(2, 2))};
    result.sigma = std::sqrt(variance) / level;
    const auto warm_after = [&](double a, double time_constant) {
      const double gain = std::abs(a) * (1.0 - std::exp(-kTenMinutes_s / time_constant));
      return gain > limit ? time_constant * std::log(gain / limit) : 0.0;
    };
    const double when = warm_after(amplitude, tau);
    constexpr double kStep = 1e-4;
    Eigen::Vector2d gradient;
    gradient << (warm_after(amplitude * (1.0 + kStep), tau) - when) / (kStep * amplitude),
        (warm_after(amplitude, tau * (1.0 + kStep)) - when) / (kStep * tau);
    const Eigen::Matrix2d shape = result.covariance.bottomRightCorner<2, 2>();
    result.warm_after_s = {when, std::sqrt(std::max(0.0, gradient.dot(shape * gradient)))};
  }

  const Slope slope = final_slope(readings, result.correlation);
  result.drift_per_10_min = {slope.per_s * kTenMinutes_s / slope.mean,
                             slope.sigma * kTenMinutes_s / slope.mean};
  result.acceptance = {"drift of the lamp in 10 min (relative)", limit,
                       std::abs(result.drift_per_10_min.value)};
  return result;
}

}  // namespace gonio::calibration::sensor
