#include "gonio/brdf/diffuse_models.h"

#include <cmath>
#include <numbers>

#include "parameter_checks.h"

namespace gonio::brdf {
namespace {

Rgb checked_albedo(const Rgb& albedo) {
  require_between("albedo", albedo, 0.0, 1.0);
  return albedo;
}

}  // namespace

Lambertian::Lambertian(const Rgb& albedo) : per_sr_(checked_albedo(albedo) / std::numbers::pi) {}

Rgb Lambertian::evaluate_visible(const ShadingGeometry&) const { return per_sr_; }

OrenNayarFactor::OrenNayarFactor(double sigma)
    : sigma_(sigma), scale_(1.0 / (1.0 + (0.5 - 2.0 / (3.0 * std::numbers::pi)) * sigma)) {
  require_between("sigma", sigma, 0.0, 1.0);
}

RoughDiffuse::RoughDiffuse(const Rgb& albedo, double sigma)
    : per_sr_(checked_albedo(albedo) / std::numbers::pi), factor_(sigma) {}

Rgb RoughDiffuse::evaluate_visible(const ShadingGeometry& g) const {
  const double wi_dot_wo = 2.0 * g.cos_theta_d * g.cos_theta_d - 1.0;
  const double sideways = wi_dot_wo - g.cos_theta_i * g.cos_theta_o;
  return per_sr_ * factor_(sideways, g.cos_theta_i, g.cos_theta_o);
}

VolumeScatter::VolumeScatter(const Rgb& albedo, double asymmetry)
    : albedo_(checked_albedo(albedo)), g_(asymmetry) {
  require_between("asymmetry", asymmetry, -0.95, 0.95);
}

Rgb VolumeScatter::evaluate_visible(const ShadingGeometry& g) const {
  // wi leaves the surface, so light goes on straight where wi.wo = -1.
  const double cos_scatter = 1.0 - 2.0 * g.cos_theta_d * g.cos_theta_d;
  const double base = 1.0 + g_ * g_ - 2.0 * g_ * cos_scatter;
  const double phase = (1.0 - g_ * g_) / (4.0 * std::numbers::pi * base * std::sqrt(base));
  return albedo_ * (phase / (g.cos_theta_i + g.cos_theta_o));
}

Sheen::Sheen(double roughness, const Rgb& tint)
    : exponent_(1.0 / roughness),
      scaled_tint_(tint * ((2.0 + exponent_) / (8.0 * std::numbers::pi))) {
  require_between("sheen roughness", roughness, 0.01, 1.0);
  require_between("tint", tint, 0.0, 1.0);
}

Rgb Sheen::evaluate_visible(const ShadingGeometry& g) const {
  const double spread = std::pow(g.sin_theta_h, exponent_);
  return scaled_tint_ * (spread / (g.cos_theta_i + g.cos_theta_o - g.cos_theta_i * g.cos_theta_o));
}

Backscatter::Backscatter(const Rgb& strength, double width)
    : per_sr_(strength / std::numbers::pi), width_(width) {
  require_between("strength", strength, 0.0, 1.0);
  require_between("width", width, 1e-3, 10.0);
}

Rgb Backscatter::evaluate_visible(const ShadingGeometry& g) const {
  return per_sr_ * (width_ * g.cos_theta_d / (width_ * g.cos_theta_d + g.sin_theta_d));
}

}  // namespace gonio::brdf
