#pragma once

#include <cmath>

#include "gonio/brdf/shading_geometry.h"

namespace gonio::brdf {

/// Solid angle of half vectors and differences that a cell of the MERL lattice stands for, up to a
/// factor. Cells are square-root spaced in theta_h, so theta_h moves by sqrt(theta_h) per index.
inline double relative_solid_angle(const SinCos& theta_h, const SinCos& theta_d) {
  return theta_h.sine * std::sqrt(theta_h.angle.radians()) * theta_d.sine * theta_d.cosine;
}

/// relative_solid_angle() times both cosines: what a cell counts for in light that is reflected.
/// Not negative above the horizon.
inline double cell_weight(const HalfDiff& at) {
  const PolarCosines cosines = polar_cosines(at.theta_h, at.theta_d, at.phi_d);
  return relative_solid_angle(SinCos(at.theta_h), SinCos(at.theta_d)) * cosines.cos_theta_i *
         cosines.cos_theta_o;
}

}  // namespace gonio::brdf
