#pragma once

#include <functional>

#include "gonio/brdf/brdf_model.h"
#include "gonio/brdf/fresnel.h"
#include "gonio/brdf/rgb_curve.h"

namespace gonio::brdf {

/// Trowbridge-Reitz (GGX) microfacet reflection with Smith height-correlated masking and exact
/// unpolarised Fresnel reflection.
/// Source  Walter et al., EGSR 2007, eq. 33-34; Heitz, JCGT 3(2) 2014, eq. 99.
class Ggx final : public BrdfModel {
 public:
  /// `alpha` in (0, 1]; `tint` in [0, 1] multiplies the lobe (1 = none).
  Ggx(double alpha, const RefractiveIndex& index, const Rgb& tint = Rgb::Ones());

  /// With facets that reflect as `reflectance` of cos theta_d says, in [0, 1]: a film, a measured
  /// curve. Not kept.
  Ggx(double alpha, const std::function<Rgb(double)>& reflectance);

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;

  double alpha_squared_;
  RgbCurve fresnel_;  ///< times tint
};

/// ABC-like lobe f = F(theta_d) A (1 + B (1 - cos theta_h))^-C G / (pi cos theta_i cos theta_o)
/// with v-groove masking G: a sharp core on a tail that falls as a power. Source: Low, Kronander,
/// Ynnerman, Unger, ACM TOG 31(1) 2012, section 5.
class AbcLobe final : public BrdfModel {
 public:
  /// `a` >= 0, `b` > 0, `c` > 0. The caller answers for the energy of `a`.
  AbcLobe(const Rgb& a, double b, double c, const RefractiveIndex& index);

  /// With A such that the facets' projected area is 1: never gains energy. `tint` in [0, 1].
  static AbcLobe normalised(double b, double c, const RefractiveIndex& index,
                            const Rgb& tint = Rgb::Ones());

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;

  double b_;
  double c_;
  RgbCurve fresnel_;  ///< times A / pi
};

/// Shifted-gamma (SGD) lobe f = rho F D G1(theta_i) G1(theta_o) / (pi cos theta_i cos theta_o),
///   D = kappa e^-a / (pi a^p cos^4 theta_h), a = alpha + tan^2 theta_h / alpha,
///   F = f0 - c f1 + (1 - f0)(1 - c)^5 clamped at 0, c = cos theta_d,
///   G1 = clamp(1 + lambda (1 - exp(c_g max(theta - theta0, 0)^k_g)), 0, 1);
/// each channel has its own constants.
/// Source  Bagher, Soler, Holzschuch, "Accurate fitting of measured reflectances using a
///         Shifted Gamma micro-facet distribution", EGSR 2012, eq. 4-9.
class ShiftedGamma final : public BrdfModel {
 public:
  struct Parameters {
    Rgb rho;    ///< >= 0; the source divides by pi, so up to pi / 4 keeps a narrow lobe's energy
    Rgb alpha;  ///< > 0
    Rgb p;      ///< shape, in [0, 2]
    Rgb f0;
    Rgb f1;
    Rgb lambda;  ///< >= 0
    Rgb c_g;     ///< >= 0
    Rgb k_g;     ///< > 0
    Rgb theta0;  ///< rad
  };
  /// kappa follows from the facets' projected area being 1, as in the source.
  explicit ShiftedGamma(const Parameters& parameters);

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;
  Rgb masking(double cosine) const;

  Parameters parameters_;
  Rgb scale_;  ///< rho kappa / pi^2
};

}  // namespace gonio::brdf
