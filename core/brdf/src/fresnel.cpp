#include "gonio/brdf/fresnel.h"

#include <cmath>
#include <complex>

namespace gonio::brdf {

double fresnel_reflectance(double cosine, double n, double k) {
  // Absorption is written n + i k, so waves go as e^(-i w t) and the root with a positive imaginary
  // part is the wave that decays. A dielectric beyond its critical angle comes out of it as well.
  const std::complex<double> epsilon = std::complex<double>(n, k) * std::complex<double>(n, k);
  const double sine_squared = 1.0 - cosine * cosine;
  const std::complex<double> q = std::sqrt(epsilon - sine_squared);
  const std::complex<double> senkrecht = (cosine - q) / (cosine + q);
  const std::complex<double> parallel = (epsilon * cosine - q) / (epsilon * cosine + q);
  return 0.5 * (std::norm(senkrecht) + std::norm(parallel));
}

Rgb fresnel_reflectance(double cosine, const RefractiveIndex& index) {
  Rgb reflectance;
  for (int channel = 0; channel < 3; ++channel) {
    reflectance[channel] = fresnel_reflectance(cosine, index.n[channel], index.k[channel]);
  }
  return reflectance;
}

double diffuse_fresnel_reflectance(double n) {
  // The integrand is smooth but steep at grazing incidence; in s = c^2 the midpoint rule meets it
  // where the light is.
  constexpr int kSteps = 2000;
  double sum = 0.0;
  for (int step = 0; step < kSteps; ++step) {
    sum += fresnel_reflectance(std::sqrt((step + 0.5) / kSteps), n, 0.0);
  }
  return sum / kSteps;
}

}  // namespace gonio::brdf
