#pragma once

#include "gonio/brdf/brdf_model.h"

namespace gonio::brdf {

/// f = albedo / pi.
class Lambertian final : public BrdfModel {
 public:
  /// `albedo` in [0, 1]; throws std::invalid_argument otherwise.
  explicit Lambertian(const Rgb& albedo);

  using BrdfModel::evaluate;
  /// The same everywhere: needs no geometry. Lengths are not looked at.
  Rgb evaluate(const DirectionPair& pair) const override {
    return pair.wi.z() > 0.0 && pair.wo.z() > 0.0 ? per_sr_ : Rgb(Rgb::Zero());
  }

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;

  Rgb per_sr_;
};

/// The angular factor of a rough diffuse surface: (1 + sigma s / t) / (1 + (1/2 - 2/(3 pi)) sigma)
/// with s = wi.wo - cos theta_i cos theta_o and t = max(cos theta_i, cos theta_o) for s > 0,
/// else 1. Never loses reciprocity nor gains energy; sigma = 0 is 1.
///
/// Source  Oren and Nayar, SIGGRAPH 1994, in the form of Fujii, "A tiny improvement of Oren-Nayar
///         reflectance model" (2012), whose albedo stays below 1 at grazing angles.
class OrenNayarFactor {
 public:
  /// `sigma` in [0, 1]: spread of the facets' slopes.
  explicit OrenNayarFactor(double sigma);
  double operator()(double sideways, double cos_theta_i, double cos_theta_o) const {
    const double t = sideways > 0.0 ? (cos_theta_i > cos_theta_o ? cos_theta_i : cos_theta_o) : 1.0;
    return scale_ * (1.0 + sigma_ * sideways / t);
  }

 private:
  double sigma_;
  double scale_;
};

/// f = albedo / pi times OrenNayarFactor.
class RoughDiffuse final : public BrdfModel {
 public:
  /// `albedo` in [0, 1], `sigma` in [0, 1].
  RoughDiffuse(const Rgb& albedo, double sigma);

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;

  Rgb per_sr_;
  OrenNayarFactor factor_;
};

/// Light scattered once in a deep porous layer: f = albedo p / (cos theta_i + cos theta_o) with the
/// Henyey-Greenstein phase function p (1/sr) of the angle between the travelling directions.
///
/// `asymmetry`  g in (-1, 1): positive scatters onwards (bright rim), negative back to the light.
/// Source       Hanrahan and Krueger, SIGGRAPH 1993, eq. 7 for infinite depth without boundary
///              (Lommel-Seeliger); Henyey and Greenstein, Astrophys. J. 93 (1941).
class VolumeScatter final : public BrdfModel {
 public:
  VolumeScatter(const Rgb& albedo, double asymmetry);

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;

  Rgb albedo_;
  double g_;
};

/// Sheen of standing fibres: f = tint D / (4 (ci + co - ci co)), D = (2 + 1/r) sin^(1/r) theta_h /
/// 2 pi.
///
/// `roughness`  r in (0, 1]; small is a narrow rim.
/// Source       Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", SIGGRAPH 2017
///              course, eq. 2; smooth denominator of Neubelt and Pettineo, SIGGRAPH 2013 course.
class Sheen final : public BrdfModel {
 public:
  Sheen(double roughness, const Rgb& tint);

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;

  double exponent_;
  Rgb scaled_tint_;
};

/// Backscatter of a surface whose shadows hide behind what casts them: f = strength / pi *
/// 1 / (1 + tan(theta_d) / width). theta_d is half the phase angle.
///
/// `width`  Tangent of the theta_d at which it has halved, > 0.
/// Source   Hapke, Icarus 67 (1986), eq. 34.
class Backscatter final : public BrdfModel {
 public:
  Backscatter(const Rgb& strength, double width);

 private:
  Rgb evaluate_visible(const ShadingGeometry& geometry) const override;

  Rgb per_sr_;
  double width_;
};

}  // namespace gonio::brdf
