#include "gonio/brdf/layered_models.h"

#include <cmath>
#include <functional>
#include <numbers>

#include "ggx.h"
#include "parameter_checks.h"

namespace gonio::brdf {
namespace {

double refracted_cosine(double cosine, double inverse_n_squared) {
  return std::sqrt(1.0 - (1.0 - cosine * cosine) * inverse_n_squared);
}

/// What gets through the coat one way.
RgbCurve transmission_of(const Coat& coat) {
  require_between("coat index", coat.n, 1.0, 3.0);
  require_between("optical depth", coat.optical_depth, 0.0, 50.0);
  return RgbCurve([&](double cosine) -> Rgb {
    const double inside = refracted_cosine(cosine, 1.0 / (coat.n * coat.n));
    return (1.0 - fresnel_reflectance(cosine, coat.n, 0.0)) * (-coat.optical_depth / inside).exp();
  });
}

/// Diffuse light from the base that comes back to it: 2 * integral F e^(-2 depth / c) c dc.
Rgb internal_reflectance(const Coat& coat) {
  constexpr int kSteps = 4000;  // the critical angle is a kink: 1e-4 of the result
  Rgb sum = Rgb::Zero();
  for (int step = 0; step < kSteps; ++step) {
    const double cosine = std::sqrt((step + 0.5) / kSteps);
    sum +=
        fresnel_reflectance(cosine, 1.0 / coat.n, 0.0) * (-2.0 * coat.optical_depth / cosine).exp();
  }
  return sum / kSteps;
}

Rgb coated_scale(const Coat& coat, const Rgb& albedo) {
  require_between("albedo", albedo, 0.0, 1.0);
  return albedo /
         (std::numbers::pi * coat.n * coat.n * (1.0 - albedo * internal_reflectance(coat)));
}

std::function<Rgb(double)> reflectance_inside(const Coat& coat, const RefractiveIndex& metal,
                                              const Rgb& tint) {
  require_physical(metal);
  require_between("tint", tint, 0.0, 1.0);
  const RefractiveIndex relative{metal.n / coat.n, metal.k / coat.n};
  return [=](double cosine) -> Rgb { return fresnel_reflectance(cosine, relative) * tint; };
}

}  // namespace

CoatedDiffuse::CoatedDiffuse(const Coat& coat, const Rgb& albedo, double sigma)
    : inverse_n_squared_(1.0 / (coat.n * coat.n)),
      factor_(sigma),
      transmission_(transmission_of(coat)),
      scale_(coated_scale(coat, albedo)) {}

Rgb CoatedDiffuse::evaluate_visible(const ShadingGeometry& g) const {
  const double wi_dot_wo = 2.0 * g.cos_theta_d * g.cos_theta_d - 1.0;
  const double sideways = (wi_dot_wo - g.cos_theta_i * g.cos_theta_o) * inverse_n_squared_;
  const double factor = factor_(sideways, refracted_cosine(g.cos_theta_i, inverse_n_squared_),
                                refracted_cosine(g.cos_theta_o, inverse_n_squared_));
  return scale_ * factor * transmission_(g.cos_theta_i) * transmission_(g.cos_theta_o);
}

CoatedMetal::CoatedMetal(const Coat& coat, double alpha, const RefractiveIndex& metal,
                         const Rgb& tint)
    : CoatedMetal(coat, alpha, reflectance_inside(coat, metal, tint)) {}

CoatedMetal::CoatedMetal(const Coat& coat, double alpha,
                         const std::function<Rgb(double)>& reflectance)
    : inverse_n_squared_(1.0 / (coat.n * coat.n)),
      alpha_squared_(alpha * alpha),
      transmission_(transmission_of(coat)),
      fresnel_(reflectance) {
  require_between("alpha", alpha, kSmallestAlpha, 1.0);
  require_reflectance(fresnel_);
}

Rgb CoatedMetal::evaluate_visible(const ShadingGeometry& g) const {
  // Refraction divides the part of wi + wo along the surface by n and leaves its azimuth.
  const double cos_i = refracted_cosine(g.cos_theta_i, inverse_n_squared_);
  const double cos_o = refracted_cosine(g.cos_theta_o, inverse_n_squared_);
  const double along = 2.0 * g.cos_theta_d * g.sin_theta_h;
  const double along_squared = along * along * inverse_n_squared_;
  const double up = cos_i + cos_o;
  const double length_squared = along_squared + up * up;
  const double lobe = ggx_lobe(alpha_squared_, along_squared / length_squared, cos_i, cos_o);
  return fresnel_(0.5 * std::sqrt(length_squared)) * (lobe * inverse_n_squared_) *
         transmission_(g.cos_theta_i) * transmission_(g.cos_theta_o);
}

}  // namespace gonio::brdf
