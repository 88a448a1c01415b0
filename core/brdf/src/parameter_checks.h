#pragma once

#include <stdexcept>
#include <string>

#include "gonio/brdf/fresnel.h"

namespace gonio::brdf {

/// Throws std::invalid_argument unless every channel lies in [low, high]; NaN never does.
inline void require_between(const char* what, const Rgb& value, double low, double high) {
  for (int channel = 0; channel < 3; ++channel) {
    if (value[channel] >= low && value[channel] <= high) continue;
    throw std::invalid_argument(std::string(what) + " is " + std::to_string(value[channel]) +
                                ", expected " + std::to_string(low) + " to " +
                                std::to_string(high));
  }
}

inline void require_between(const char* what, double value, double low, double high) {
  require_between(what, Rgb::Constant(value), low, high);
}

inline void require_physical(const RefractiveIndex& index) {
  require_between("refractive index n", index.n, 1e-3, 20.0);
  require_between("extinction coefficient k", index.k, 0.0, 20.0);
}

/// Smallest lobe width that is not taken for a slip: 0.006 deg.
constexpr double kSmallestAlpha = 1e-4;

}  // namespace gonio::brdf
