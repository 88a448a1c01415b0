#include "gonio/sim/angular_white.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace gonio::sim {
namespace {

// Below this product of sines light or detector stands on the normal and has no azimuth.
constexpr double kPole = 1e-12;

void require_rising(const std::vector<Angle>& nodes, const char* what) {
  const bool finite = std::all_of(nodes.begin(), nodes.end(),
                                  [](Angle node) { return std::isfinite(node.radians()); });
  const bool rising = std::adjacent_find(nodes.begin(), nodes.end(),
                                         [](Angle a, Angle b) { return a >= b; }) == nodes.end();
  if (nodes.empty() || !finite || !rising) {
    throw std::invalid_argument(
        fmt::format("white table: {}: expected at least one node, finite and rising", what));
  }
}

/// A place between two nodes.
struct Place {
  std::size_t below;
  std::size_t above;
  double share;  ///< of the node above
};

Place place_in(const std::vector<Angle>& nodes, double radians) {
  const auto above = std::upper_bound(nodes.begin(), nodes.end(), Angle::from_radians(radians));
  if (above == nodes.begin()) return {0, 0, 0.0};
  const auto below = static_cast<std::size_t>(above - nodes.begin()) - 1;
  if (above == nodes.end()) return {below, below, 0.0};
  return {below, below + 1, (radians - nodes[below].radians()) / (*above - nodes[below]).radians()};
}

}  // namespace

AngularWhite::AngularWhite(const brdf::Rgb& reflectance, AngularFactor factor)
    : per_sr_(reflectance * std::numbers::inv_pi), table_(std::move(factor)) {
  if (!((reflectance >= 0.0).all() && (reflectance <= 1.0).all())) {
    throw std::invalid_argument("white table: reflectance: expected 0 .. 1");
  }
  require_rising(table_.theta_i, "theta_i");
  require_rising(table_.theta_o, "theta_o");
  require_rising(table_.delta_phi, "delta_phi");
  const std::size_t nodes = table_.theta_i.size() * table_.theta_o.size() * table_.delta_phi.size();
  if (table_.factor.size() != nodes) {
    throw std::invalid_argument(fmt::format("white table: factor: found {} values, expected {}",
                                            table_.factor.size(), nodes));
  }
  for (const double value : table_.factor) {
    if (!(value >= 0.0 && std::isfinite(value))) {
      throw std::invalid_argument(
          fmt::format("white table: factor: found {}, expected zero or more", value));
    }
  }
}

brdf::Rgb AngularWhite::evaluate_visible(const brdf::ShadingGeometry& geometry) const {
  const double cos_i = std::min(1.0, geometry.cos_theta_i);
  const double cos_o = std::min(1.0, geometry.cos_theta_o);
  const double sines = std::sqrt((1.0 - cos_i * cos_i) * (1.0 - cos_o * cos_o));
  // wi . wo = cos(2 theta_d)
  const double between = 2.0 * geometry.cos_theta_d * geometry.cos_theta_d - 1.0;
  const double delta_phi =
      sines < kPole ? 0.0 : std::acos(std::clamp((between - cos_i * cos_o) / sines, -1.0, 1.0));

  const Place i = place_in(table_.theta_i, std::acos(cos_i));
  const Place o = place_in(table_.theta_o, std::acos(cos_o));
  const Place p = place_in(table_.delta_phi, delta_phi);
  const auto at = [&](std::size_t a, std::size_t b, std::size_t c) {
    return table_.factor[(a * table_.theta_o.size() + b) * table_.delta_phi.size() + c];
  };
  const auto along_phi = [&](std::size_t a, std::size_t b) {
    return std::lerp(at(a, b, p.below), at(a, b, p.above), p.share);
  };
  const auto along_o = [&](std::size_t a) {
    return std::lerp(along_phi(a, o.below), along_phi(a, o.above), o.share);
  };
  return per_sr_ * std::lerp(along_o(i.below), along_o(i.above), i.share);
}

}  // namespace gonio::sim
