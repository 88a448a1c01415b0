#pragma once

#include "gonio/brdf/brdf_model.h"

namespace gonio::brdf {

/// Complex refractive index per channel, n + i k with k >= 0; k = 0 is a dielectric.
struct RefractiveIndex {
  Rgb n;
  Rgb k;
};

/// The same real index in all channels.
inline RefractiveIndex dielectric(double n) { return {Rgb::Constant(n), Rgb::Zero()}; }

/// Exact unpolarised Fresnel reflectance of the boundary from vacuum (or a medium the index is
/// relative to) to n + i k, in [0, 1]. `cosine` in [0, 1], n > 0, k >= 0; n < 1 with k = 0 gives
/// total reflection beyond the critical angle.
/// Source  Born and Wolf, Principles of Optics, 7th ed., sections 1.5.2 and 14.2.
double fresnel_reflectance(double cosine, double n, double k);
Rgb fresnel_reflectance(double cosine, const RefractiveIndex& index);

/// Reflectance of a dielectric boundary for diffuse light from outside, 2 * integral F(c) c dc.
double diffuse_fresnel_reflectance(double n);

}  // namespace gonio::brdf
