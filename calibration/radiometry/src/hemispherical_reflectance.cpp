#include "gonio/calibration/radiometry/hemispherical_reflectance.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace gonio::calibration {
namespace {

constexpr double kFrom_deg = 45.0;  // the reference's theta_i, where certificates hold best
constexpr int kRings = 30;          // of equal projected solid angle
constexpr int kSectors = 36;
// Of sin^2 theta_i + sin^2 theta_o among the poses: less does not tell a slope from a level.
constexpr double kLeastSpread = 0.5;
constexpr Eigen::Index kFewestForSlope = 4;
/// What a pose is off by at least: few of them may agree by chance.
constexpr double kLeastScatter = 0.001;

double slant_of(const brdf::DirectionPair& directions) {
  const auto sine2 = [](const Eigen::Vector3d& w) { return 1.0 - w.z() * w.z(); };
  return sine2(directions.wi) + sine2(directions.wo);
}

/// Integrals of the certificate's table, and of the table times `slant_of` less `middle`, over all
/// directions of the light thrown back; by the midpoint rule.
Eigen::Vector2d integrals(const instrument::WhiteReference& white, int channel, double middle) {
  const Angle from = Angle::from_degrees(kFrom_deg);
  const Eigen::Vector3d wi(sin(from), 0.0, cos(from));
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (int ring = 0; ring < kRings; ++ring) {
    const double sine = std::sqrt((ring + 0.5) / kRings);
    const double cosine = std::sqrt(1.0 - sine * sine);
    for (int sector = 0; sector < kSectors; ++sector) {
      const double phi = 2.0 * std::numbers::pi * (sector + 0.5) / kSectors;
      const brdf::DirectionPair directions{wi,
                                           {sine * std::cos(phi), sine * std::sin(phi), cosine}};
      const double value = instrument::white_brdf(white, directions)[channel];
      sum += value * Eigen::Vector2d(1.0, slant_of(directions) - middle);
    }
  }
  return std::numbers::pi / (kRings * kSectors) * sum;
}

}  // namespace

HemisphericalReflectance hemispherical_reflectance(const instrument::WhiteReference& white,
                                                   int channel,
                                                   const std::vector<WhiteReading>& readings) {
  const auto count = static_cast<Eigen::Index>(readings.size());
  Eigen::VectorXd over(count);  // of the certificate's
  Eigen::VectorXd slant(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const WhiteReading& reading = readings[static_cast<std::size_t>(i)];
    over[i] = reading.brdf / instrument::white_brdf(white, reading.directions)[channel];
    slant[i] = slant_of(reading.directions);
  }
  const double middle = slant.mean();
  const bool sloped =
      count >= kFewestForSlope && slant.maxCoeff() - slant.minCoeff() > kLeastSpread;
  Eigen::MatrixXd design = Eigen::MatrixXd::Ones(count, sloped ? 2 : 1);
  if (sloped) design.col(1) = slant.array() - middle;
  const Eigen::MatrixXd normal = design.transpose() * design;
  const Eigen::LDLT<Eigen::MatrixXd> factored(normal);
  const Eigen::VectorXd sizes = factored.solve(design.transpose() * over);
  const double free = std::max(1.0, static_cast<double>(count - design.cols()));
  const double scatter =
      std::max(kLeastScatter, std::sqrt((over - design * sizes).squaredNorm() / free));

  const Eigen::Vector2d whole = integrals(white, channel, middle);
  const Eigen::VectorXd weights = whole.head(design.cols());
  return {weights.dot(sizes), scatter * std::sqrt(weights.dot(factored.solve(weights))), whole[0]};
}

}  // namespace gonio::calibration
