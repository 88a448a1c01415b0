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

/// A transparent film on a substrate.
struct Film {
  Rgb n;                ///< real, in vacuum, at 630, 532 and 465 nm
  double thickness_nm;  ///< >= 0; 0 is the bare substrate
};

/// Reflectance of a substrate under a film: interference colours that turn with the angle.
/// `cosine` in [0, 1] and `n_outside` are of the medium the light comes from; both other indices
/// are in vacuum.
/// Source  Airy summation: Born and Wolf, section 1.6.4, eq. 55-60.
Rgb film_reflectance(double cosine, double n_outside, const Film& film,
                     const RefractiveIndex& substrate);

/// Reflectance of a dielectric boundary for diffuse light from outside, 2 * integral F(c) c dc.
double diffuse_fresnel_reflectance(double n);

}  // namespace gonio::brdf
