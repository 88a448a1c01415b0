#include "gonio/brdf/fresnel.h"

#include <cmath>
#include <complex>
#include <numbers>

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

Rgb film_reflectance(double cosine, double n_outside, const Film& film,
                     const RefractiveIndex& substrate) {
  using Complex = std::complex<double>;
  constexpr double kWavelength_nm[3] = {630.0, 532.0, 465.0};
  Rgb reflectance;
  for (int channel = 0; channel < 3; ++channel) {
    // q = n cos(theta) is what both amplitudes are made of; n sin(theta) is common to all layers.
    const double along = n_outside * n_outside * (1.0 - cosine * cosine);
    const Complex epsilon[3] = {n_outside * n_outside, film.n[channel] * film.n[channel],
                                std::pow(Complex(substrate.n[channel], substrate.k[channel]), 2)};
    Complex q[3];
    for (int layer = 0; layer < 3; ++layer) q[layer] = std::sqrt(epsilon[layer] - along);
    const Complex round_trip = std::exp(Complex(0.0, 4.0 * std::numbers::pi) * q[1] *
                                        (film.thickness_nm / kWavelength_nm[channel]));
    const auto stack = [&](const Complex& upper, const Complex& lower) {
      return std::norm((upper + lower * round_trip) / (1.0 + upper * lower * round_trip));
    };
    const auto senkrecht = [&](int a, int b) { return (q[a] - q[b]) / (q[a] + q[b]); };
    const auto parallel = [&](int a, int b) {
      return (epsilon[b] * q[a] - epsilon[a] * q[b]) / (epsilon[b] * q[a] + epsilon[a] * q[b]);
    };
    reflectance[channel] =
        0.5 * (stack(senkrecht(0, 1), senkrecht(1, 2)) + stack(parallel(0, 1), parallel(1, 2)));
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
