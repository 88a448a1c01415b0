#pragma once

#include <array>
#include <vector>

#include "gonio/brdf/directions.h"
#include "gonio/samples/samples.h"

namespace gonio {

/// A direction from its three angles in degrees.
inline brdf::HalfDiff half_diff_deg(double theta_h, double theta_d, double phi_d) {
  return {Angle::from_degrees(theta_h), Angle::from_degrees(theta_d), Angle::from_degrees(phi_d),
          Angle()};
}

/// A list of them, as if it had been read from a file.
inline std::vector<samples::Direction> direction_list_deg(
    const std::vector<std::array<double, 3>>& angles) {
  std::vector<samples::Direction> directions;
  for (const auto& [theta_h, theta_d, phi_d] : angles) {
    samples::Direction direction;
    direction.angles = half_diff_deg(theta_h, theta_d, phi_d);
    directions.push_back(direction);
  }
  return directions;
}

}  // namespace gonio
