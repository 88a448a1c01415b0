#include "angular_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace gonio::instrument {
namespace {

constexpr double kDegreesPerRadian = 180.0 / std::numbers::pi;
// Shorter parts across the normal are rounding and point nowhere.
constexpr double kOnNormal = 1e-12;

void require_nodes(const std::vector<double>& nodes, const char* name, double most_deg) {
  const auto refuse = [&](double found) {
    throw std::invalid_argument(
        fmt::format("instrument: white.angular.{} is {}, expected ascending nodes within 0 to {}",
                    name, found, most_deg));
  };
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!(nodes[i] >= 0.0 && nodes[i] <= most_deg)) refuse(nodes[i]);
    if (i > 0 && !(nodes[i] > nodes[i - 1])) refuse(nodes[i]);
  }
}

/// An angle as the two nodes about it; the same one twice beyond the ends.
struct Between {
  std::size_t lower;
  std::size_t upper;
  double upper_weight;
};

Between between(const std::vector<double>& nodes, double angle_deg) {
  std::size_t upper = 0;
  while (upper < nodes.size() && nodes[upper] < angle_deg) ++upper;
  if (upper == 0) return {0, 0, 0.0};
  if (upper == nodes.size()) return {upper - 1, upper - 1, 0.0};
  return {upper - 1, upper, (angle_deg - nodes[upper - 1]) / (nodes[upper] - nodes[upper - 1])};
}

double polar_deg(const Eigen::Vector3d& direction) {
  return std::atan2(direction.head<2>().norm(), direction.z()) * kDegreesPerRadian;
}

double azimuth_between_deg(const Eigen::Vector3d& wi, const Eigen::Vector3d& wo) {
  const double along = wi.head<2>().dot(wo.head<2>());
  const double across = wi.x() * wo.y() - wi.y() * wo.x();
  if (std::hypot(along, across) < kOnNormal) return 0.0;
  return std::atan2(std::abs(across), along) * kDegreesPerRadian;
}

double relative_factor(const AngularTable& table, const brdf::DirectionPair& directions) {
  const Between i = between(table.theta_i_deg, polar_deg(directions.wi));
  const Between o = between(table.theta_o_deg, polar_deg(directions.wo));
  const Between p = between(table.delta_phi_deg, azimuth_between_deg(directions.wi, directions.wo));
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    std::size_t node = 0;
    double weight = 1.0;
    const auto step = [&](const Between& place, std::size_t count, bool upper) {
      node = node * count + (upper ? place.upper : place.lower);
      weight *= upper ? place.upper_weight : 1.0 - place.upper_weight;
    };
    step(i, table.theta_i_deg.size(), (corner & 4) != 0);
    step(o, table.theta_o_deg.size(), (corner & 2) != 0);
    step(p, table.delta_phi_deg.size(), (corner & 1) != 0);
    sum += weight * table.factor[node];
  }
  return sum;
}

}  // namespace

void require_table(const AngularTable& table) {
  require_nodes(table.theta_i_deg, "theta_i_deg", 90.0);
  require_nodes(table.theta_o_deg, "theta_o_deg", 90.0);
  require_nodes(table.delta_phi_deg, "delta_phi_deg", 180.0);
  const std::size_t expected =
      table.theta_i_deg.size() * table.theta_o_deg.size() * table.delta_phi_deg.size();
  if (table.factor.size() != expected) {
    throw std::invalid_argument(
        fmt::format("instrument: white.angular.factor has {} values, expected {}, one for every "
                    "combination of nodes",
                    table.factor.size(), expected));
  }
  for (const double factor : table.factor) {
    if (!(factor > 0.0 && std::isfinite(factor))) {
      throw std::invalid_argument(
          fmt::format("instrument: white.angular.factor is {}, expected above 0", factor));
    }
  }
}

AngularTable AngularTable::of_incidence(std::vector<double> theta_i_deg,
                                        std::vector<double> factor) {
  return {std::move(theta_i_deg), {0.0}, {0.0}, std::move(factor)};
}

brdf::Rgb white_brdf(const WhiteReference& white, const brdf::DirectionPair& directions) {
  const double relative = white.angular.empty() ? 1.0 : relative_factor(white.angular, directions);
  return white.reflectance * (relative * std::numbers::inv_pi);
}

}  // namespace gonio::instrument
