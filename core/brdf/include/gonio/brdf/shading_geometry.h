#pragma once

#include "gonio/brdf/directions.h"

namespace gonio::brdf {

/// An angle with its sine and cosine, so that a lattice pays for them once per index.
struct SinCos {
  Angle angle;
  double sine = 0.0;
  double cosine = 1.0;

  SinCos() = default;
  explicit SinCos(Angle value) : angle(value), sine(sin(value)), cosine(cos(value)) {}
};

/// Everything an isotropic BRDF may depend on, worked out once per pair of directions and shared by
/// all models that are evaluated there (a basis is trained on a hundred at a million places).
///
/// Range    Cosines in [-1, 1]; a cosine theta_i or theta_o <= 0 lies at or below the horizon.
///          cos_theta_h, sin_theta_h, cos_theta_d and sin_theta_d in [0, 1]. sin_theta_h is kept
///          beside the cosine because a polished lobe lives where the cosine rounds to 1.
struct ShadingGeometry {
  HalfDiff half_diff;
  double cos_theta_i;
  double cos_theta_o;
  double cos_theta_h;
  double sin_theta_h;
  double cos_theta_d;
  double sin_theta_d;
  double cos_phi_d;
  double sin_phi_d;

  bool above_horizon() const { return cos_theta_i > 0.0 && cos_theta_o > 0.0; }
};

/// Throws std::invalid_argument as half_diff_from_directions() does.
ShadingGeometry shading_geometry(const DirectionPair& pair);

/// From half/difference angles; phi_h is kept but nothing else depends on it.
ShadingGeometry shading_geometry(const HalfDiff& half_diff);

/// The same without a call to sin or cos: for loops over a lattice. phi_h is 0.
inline ShadingGeometry shading_geometry(const SinCos& theta_h, const SinCos& theta_d,
                                        const SinCos& phi_d) {
  const double straight = theta_h.cosine * theta_d.cosine;
  const double sideways = theta_h.sine * theta_d.sine * phi_d.cosine;
  return {{theta_h.angle, theta_d.angle, phi_d.angle, Angle()},
          straight - sideways,
          straight + sideways,
          theta_h.cosine,
          theta_h.sine,
          theta_d.cosine,
          theta_d.sine,
          phi_d.cosine,
          phi_d.sine};
}

}  // namespace gonio::brdf
