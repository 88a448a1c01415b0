#include "gonio/brdf/microfacet_models.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "ggx.h"
#include "parameter_checks.h"

namespace gonio::brdf {
namespace {

RgbCurve scaled_fresnel(const RefractiveIndex& index, const Rgb& scale) {
  require_physical(index);
  return RgbCurve([&](double cosine) -> Rgb { return scale * fresnel_reflectance(cosine, index); });
}

/// Integral of s^exponent from 1 to end.
double power_integral(double exponent, double end) {
  const double next = exponent + 1.0;
  return std::abs(next) < 1e-9 ? std::log(end) : std::expm1(next * std::log(end)) / next;
}

/// Upper incomplete gamma function of 1 - p at alpha: integral of e^-a a^-p from alpha on. With
/// a = e^u the integrand is smooth however small alpha is.
double upper_gamma(double p, double alpha) {
  constexpr int kSteps = 4000;
  const double from = std::log(alpha);
  const double to = std::log(alpha + 60.0);
  const double step = (to - from) / kSteps;
  double sum = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double u = from + (i + 0.5) * step;
    sum += std::exp((1.0 - p) * u - std::exp(u));
  }
  return sum * step;
}

}  // namespace

Ggx::Ggx(double alpha, const RefractiveIndex& index, const Rgb& tint)
    : alpha_squared_(alpha * alpha), fresnel_(scaled_fresnel(index, tint)) {
  require_between("alpha", alpha, kSmallestAlpha, 1.0);
  require_between("tint", tint, 0.0, 1.0);
}

Ggx::Ggx(double alpha, const std::function<Rgb(double)>& reflectance)
    : alpha_squared_(alpha * alpha), fresnel_(reflectance) {
  require_between("alpha", alpha, kSmallestAlpha, 1.0);
  require_reflectance(fresnel_);
}

Rgb Ggx::evaluate_visible(const ShadingGeometry& g) const {
  return fresnel_(g.cos_theta_d) *
         ggx_lobe(alpha_squared_, g.sin_theta_h * g.sin_theta_h, g.cos_theta_i, g.cos_theta_o);
}

AbcLobe::AbcLobe(const Rgb& a, double b, double c, const RefractiveIndex& index)
    : b_(b), c_(c), fresnel_(scaled_fresnel(index, a / std::numbers::pi)) {
  require_between("A", a, 0.0, 1e9);
  require_between("B", b, 1e-6, 1e9);
  require_between("C", c, 1e-6, 100.0);
}

AbcLobe AbcLobe::normalised(double b, double c, const RefractiveIndex& index, const Rgb& tint) {
  require_between("B", b, 1e-6, 1e9);
  require_between("C", c, 1e-6, 100.0);
  require_between("tint", tint, 0.0, 1.0);
  // 2 pi times the integral of (1 + B (1 - u))^-C u du, u = cos theta_h, with s = 1 + B (1 - u).
  const double end = 1.0 + b;
  const double area =
      2.0 * std::numbers::pi / b *
      ((1.0 + 1.0 / b) * power_integral(-c, end) - power_integral(1.0 - c, end) / b);
  // f = F D G / (4 cos cos), so A / pi = D(0) / 4.
  return AbcLobe(tint * (std::numbers::pi / (4.0 * area)), b, c, index);
}

Rgb AbcLobe::evaluate_visible(const ShadingGeometry& g) const {
  // 1 - cos without cancellation near the pole.
  const double one_minus_cos = g.sin_theta_h * g.sin_theta_h / (1.0 + g.cos_theta_h);
  const double distribution = std::exp(-c_ * std::log1p(b_ * one_minus_cos));
  const double low = std::min(g.cos_theta_i, g.cos_theta_o);
  const double masking = std::min(1.0, 2.0 * g.cos_theta_h * low / g.cos_theta_d);
  return fresnel_(g.cos_theta_d) * (distribution * masking / (g.cos_theta_i * g.cos_theta_o));
}

ShiftedGamma::ShiftedGamma(const Parameters& parameters) : parameters_(parameters) {
  require_between("rho", parameters.rho, 0.0, 100.0);
  require_between("alpha", parameters.alpha, 1e-6, 10.0);
  require_between("p", parameters.p, 0.0, 2.0);
  require_between("f0", parameters.f0, 0.0, 1.0);
  require_between("f1", parameters.f1, -1.0, 1.0);
  require_between("lambda", parameters.lambda, 0.0, 1e3);
  require_between("c_g", parameters.c_g, 0.0, 1e3);
  require_between("k_g", parameters.k_g, 1e-3, 1e3);
  require_between("theta0", parameters.theta0, -std::numbers::pi, std::numbers::pi);
  for (int channel = 0; channel < 3; ++channel) {
    const double alpha = parameters.alpha[channel];
    const double kappa = 1.0 / (alpha * upper_gamma(parameters.p[channel], alpha));
    scale_[channel] = parameters.rho[channel] * kappa / (std::numbers::pi * std::numbers::pi);
  }
}

Rgb ShiftedGamma::masking(double cosine) const {
  const double theta = std::acos(std::min(cosine, 1.0));
  const Rgb beyond = theta - parameters_.theta0;
  Rgb visible = Rgb::Ones();
  for (int channel = 0; channel < 3; ++channel) {
    if (beyond[channel] <= 0.0) continue;
    const double power = std::pow(beyond[channel], parameters_.k_g[channel]);
    const double lost = std::expm1(parameters_.c_g[channel] * power);
    visible[channel] = std::clamp(1.0 - parameters_.lambda[channel] * lost, 0.0, 1.0);
  }
  return visible;
}

Rgb ShiftedGamma::evaluate_visible(const ShadingGeometry& g) const {
  const double cos_squared = g.cos_theta_h * g.cos_theta_h;
  if (cos_squared <= 0.0) return Rgb::Zero();
  const double tan_squared = g.sin_theta_h * g.sin_theta_h / cos_squared;
  const Rgb a = parameters_.alpha + tan_squared / parameters_.alpha;
  const Rgb distribution = (-a - parameters_.p * a.log()).exp() / (cos_squared * cos_squared);
  const double away = 1.0 - g.cos_theta_d;
  const double away5 = away * away * away * away * away;
  const Rgb fresnel =
      (parameters_.f0 - g.cos_theta_d * parameters_.f1 + away5 * (1.0 - parameters_.f0)).max(0.0);
  return scale_ * fresnel * distribution * masking(g.cos_theta_i) * masking(g.cos_theta_o) /
         (g.cos_theta_i * g.cos_theta_o);
}

}  // namespace gonio::brdf
