#include "weighted_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/errors/errors.h"

namespace gonio::calibration::sensor {

double WeightedFit::chi2_per_dof() const {
  return degrees_of_freedom > 0 ? chi2 / static_cast<double>(degrees_of_freedom) : 1.0;
}

double WeightedFit::widening() const { return std::max(1.0, chi2_per_dof()); }

WeightedFit weighted_fit(const Eigen::MatrixXd& design, const Eigen::VectorXd& y,
                         const Eigen::VectorXd& sigma) {
  const Eigen::MatrixXd weighted = sigma.cwiseInverse().asDiagonal() * design;
  const Eigen::VectorXd scale = weighted.colwise().norm();
  constexpr double kIndependent = 1e-9;  // of columns of length 1; double rounds at 1e-16
  if (!weighted.allFinite() || !y.allFinite() || !(scale.minCoeff() > 0.0)) {
    throw NumericalError("weighted fit: numbers that are none, or a parameter without effect");
  }
  const Eigen::MatrixXd scaled = weighted * scale.cwiseInverse().asDiagonal();
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled);
  qr.setThreshold(kIndependent);
  if (qr.rank() < design.cols()) {
    throw NumericalError("weighted fit: the points do not determine the parameters");
  }
  WeightedFit fit;
  const Eigen::VectorXd target = y.cwiseQuotient(sigma);
  const Eigen::MatrixXd inverse =
      (scaled.transpose() * scaled)
          .ldlt()
          .solve(Eigen::MatrixXd::Identity(design.cols(), design.cols()));
  fit.parameters = qr.solve(target).cwiseQuotient(scale);
  fit.covariance = scale.cwiseInverse().asDiagonal() * inverse * scale.cwiseInverse().asDiagonal();
  fit.fitted = design * fit.parameters;
  fit.chi2 = (y - fit.fitted).cwiseQuotient(sigma).squaredNorm();
  fit.degrees_of_freedom = design.rows() - design.cols();
  return fit;
}

DarkLine dark_line(const char* step, std::span<const LevelStatistics> dark, double saturation_dn) {
  if (dark.empty()) {
    throw StepRefused(
        fmt::format("{}: no dark level, expected one at least: close the shutter and "
                    "take two frames at the shortest exposure",
                    step));
  }
  constexpr double kLight = 0.25;     // of saturation; no black level is set that high
  constexpr double kClipped = 0.001;  // what a black level of 3 sigma would clip
  for (const LevelStatistics& level : dark) {
    if (level.mean_dn.value > kLight * saturation_dn) {
      throw StepRefused(fmt::format(
          "{}: a dark level has {:.0f} DN, expected less than {:.0f}: light came in, or a bright "
          "level was given as dark; close the shutter",
          step, level.mean_dn.value, kLight * saturation_dn));
    }
    if (level.black_fraction > kClipped) {
      throw StepRefused(fmt::format(
          "{}: {:.2g} % of the dark pixels are 0 DN, expected less than {:.2g} %: the black level "
          "cuts the noise off; raise it",
          step, 100.0 * level.black_fraction, 100.0 * kClipped));
    }
  }
  const auto [shortest, longest] = std::minmax_element(
      dark.begin(), dark.end(), [](const LevelStatistics& a, const LevelStatistics& b) {
        return a.exposure_s < b.exposure_s;
      });
  const auto rows = static_cast<Eigen::Index>(dark.size());
  const Eigen::Index columns = shortest->exposure_s < longest->exposure_s ? 2 : 1;
  Eigen::MatrixXd design = Eigen::MatrixXd::Ones(rows, columns);
  Eigen::VectorXd mean(rows);
  Eigen::VectorXd sigma(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    const LevelStatistics& level = dark[static_cast<std::size_t>(k)];
    if (columns == 2) design(k, 1) = level.exposure_s;
    mean[k] = level.mean_dn.value;
    sigma[k] = std::max(level.mean_dn.sigma, 1e-6);  // a frame without any noise has a mean too
  }
  const WeightedFit fit = weighted_fit(design, mean, sigma);
  DarkLine line;
  const double widening = fit.widening();
  line.offset_dn = {fit.parameters[0], std::sqrt(fit.covariance(0, 0) * widening)};
  if (columns == 2) {
    line.rate_dn_per_s = {fit.parameters[1], std::sqrt(fit.covariance(1, 1) * widening)};
  }
  return line;
}

void require_light(const char* step, std::span<const LevelStatistics> levels,
                   const DarkLine& dark) {
  double brightest = 0.0;
  for (const LevelStatistics& level : levels) {
    brightest = std::max(brightest, level.mean_dn.value - dark.at(level.exposure_s));
  }
  constexpr double kLightDn = 5.0;  // dark drift stays below; no sweep ends there
  if (levels.empty() || !(brightest > kLightDn)) {
    throw StepRefused(
        fmt::format("{}: the brightest of {} levels is {:.2f} DN above dark, expected more than "
                    "{:.0f}: the lamp "
                    "is off or the shutter closed",
                    step, levels.size(), brightest, kLightDn));
  }
}

}  // namespace gonio::calibration::sensor
