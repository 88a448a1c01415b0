#pragma once

#include <functional>

#include "gonio/brdf/brdf_model.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/brdf/fresnel.h"
#include "gonio/brdf/rgb_curve.h"

namespace gonio::brdf {

/// A clear coat: refracts and, if coloured, absorbs. Its own reflection is a lobe to be added
/// beside it (Ggx of the same index), in a Mixture.
struct Coat {
  double n;                         ///< 1 < n <= 3
  Rgb optical_depth = Rgb::Zero();  ///< >= 0, for light straight through it once
};

/// Diffuse base seen through a smooth coat: refraction and Fresnel loss on both ways, absorption
/// along the slant path and all internal reflections.
/// f = t(i) t(o) albedo w / (pi n^2 (1 - albedo r)), t = (1 - F) e^(-depth / cos), r the coat's
/// internal reflectance for diffuse light, w = OrenNayarFactor of the refracted directions.
///
/// Source  Elias, Simonot, Applied Optics 41 (2002); Jakob, Mitsuba plastic (2010), "nonlinear".
class CoatedDiffuse final : public BrdfModel {
 public:
  /// `albedo` of the base in [0, 1], `sigma` as in RoughDiffuse.
  CoatedDiffuse(const Coat& coat, const Rgb& albedo, double sigma = 0.0);

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;

  double inverse_n_squared_;
  OrenNayarFactor factor_;
  RgbCurve transmission_;
  Rgb scale_;
};

/// Flakes or rough metal seen through a smooth coat: a GGX lobe of the refracted directions, whose
/// index is taken relative to the coat, with Fresnel loss and absorption on both ways. Light that
/// is reflected back inside the coat is counted as lost.
/// f = t(i) t(o) f_ggx(i', o') / n^2.
class CoatedMetal final : public BrdfModel {
 public:
  /// `alpha` in (0, 1], `metal` in vacuum, `tint` in [0, 1].
  CoatedMetal(const Coat& coat, double alpha, const RefractiveIndex& metal,
              const Rgb& tint = Rgb::Ones());

  /// With facets that reflect as `reflectance` of their cosine inside the coat says, in [0, 1].
  CoatedMetal(const Coat& coat, double alpha, const std::function<Rgb(double)>& reflectance);

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;

  double inverse_n_squared_;
  double alpha_squared_;
  RgbCurve transmission_;
  RgbCurve fresnel_;  ///< of the facets, inside the coat
};

}  // namespace gonio::brdf
