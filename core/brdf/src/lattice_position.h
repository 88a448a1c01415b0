#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "gonio/brdf/merl_lattice.h"

namespace gonio::brdf::lattice {

/// Where an axis coordinate falls between two neighbouring indices.
struct Bracket {
  int lower;
  int upper;
  double upper_weight;  ///< in [0, 1]; the lower one has the rest
};

/// The three brackets around a direction.
struct Position {
  Bracket theta_h;
  Bracket theta_d;
  Bracket phi_d;
};

/// Ends hold: below index 0 and above the last the end value counts. NaN lands on index 0, so an
/// index is always legal.
inline Bracket clamped_bracket(double coordinate, int count) {
  if (!(coordinate > 0.0)) return {0, 0, 0.0};
  if (coordinate >= count - 1) return {count - 1, count - 1, 0.0};
  const int lower = static_cast<int>(coordinate);
  return {lower, lower + 1, coordinate - lower};
}

/// Half-degree reciprocity: folds any phi_d in degrees into [0, 180). Not finite gives 0.
inline double fold_phi_d(double degrees) {
  if (degrees < 0.0) degrees += 180.0;
  if (degrees >= 180.0) degrees -= 180.0;
  if (degrees >= 0.0 && degrees < 180.0) return degrees;
  degrees -= 180.0 * std::floor(degrees / 180.0);
  return degrees >= 0.0 && degrees < 180.0 ? degrees : 0.0;
}

/// Distance of index 0 from the axis' origin, in index steps, of the conventions whose steps are
/// one degree (left edge, bin centre).
constexpr double index_offset(IndexConvention convention) {
  return convention == IndexConvention::bin_centre ? 0.5 : 0.0;
}
constexpr double kDtuThetaHOffset = 0.105;
constexpr double kDtuThetaDStep = 90.0 / 89.0;  ///< degrees per index
constexpr double kDtuPhiDStep = 180.0 / 179.0;  ///< degrees per index

constexpr double kDegrees = 180.0 / std::numbers::pi;  ///< degrees per radian

/// The square-root spaced coordinate of theta_h: 0 at the pole, 90 at 90 deg.
inline double theta_h_coordinate(double theta_h_rad) {
  constexpr double kScale = 90.0 * 90.0 * 2.0 / std::numbers::pi;
  return std::sqrt(theta_h_rad * kScale);
}

inline Position position_of(double theta_h_rad, double theta_d_rad, double phi_d_rad,
                            IndexConvention convention) {
  const double u = theta_h_coordinate(theta_h_rad);
  const double theta_d = theta_d_rad * kDegrees;
  const double phi_d = fold_phi_d(phi_d_rad * kDegrees);
  if (convention == IndexConvention::dtu) {
    // Index 179 is 180 deg, the reciprocal of index 0: the axis is closed and needs no wrap.
    return {clamped_bracket(u - kDtuThetaHOffset, kThetaH),
            clamped_bracket(theta_d / kDtuThetaDStep, kThetaD),
            clamped_bracket(phi_d / kDtuPhiDStep, kPhiD)};
  }
  const double offset = index_offset(convention);
  const double p = phi_d - offset;  // [-0.5, 180)
  const int lower = static_cast<int>(p + 1.0) - 1;
  constexpr int kLast = static_cast<int>(kPhiD) - 1;
  const Bracket phi{lower < 0 ? kLast : lower, lower == kLast ? 0 : lower + 1, p - lower};
  return {clamped_bracket(u - offset, kThetaH), clamped_bracket(theta_d - offset, kThetaD), phi};
}

}  // namespace gonio::brdf::lattice
