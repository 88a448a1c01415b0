#pragma once

#include <cmath>
#include <numbers>

namespace gonio::brdf {

/// D G2 / (4 cos theta_i cos theta_o) of the GGX distribution: all of the lobe but its Fresnel
/// factor. Squares are passed because refraction yields them.
inline double ggx_lobe(double alpha_squared, double sin_h_squared, double cos_i, double cos_o) {
  const double slope = sin_h_squared + alpha_squared * (1.0 - sin_h_squared);
  const double distribution = alpha_squared / (std::numbers::pi * slope * slope);
  const double one_minus = 1.0 - alpha_squared;
  const double visibility = 0.5 / (cos_o * std::sqrt(alpha_squared + one_minus * cos_i * cos_i) +
                                   cos_i * std::sqrt(alpha_squared + one_minus * cos_o * cos_o));
  return distribution * visibility;
}

}  // namespace gonio::brdf
