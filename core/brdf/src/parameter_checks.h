#pragma once

#include <stdexcept>
#include <string>

#include "gonio/brdf/fresnel.h"
#include "gonio/brdf/rgb_curve.h"

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

/// Looks at a facet reflectance at 65 cosines: rounding of the curve may exceed 1 by 1e-6.
inline void require_reflectance(const RgbCurve& curve) {
  for (int i = 0; i <= 64; ++i) {
    require_between("facet reflectance", curve(i / 64.0), 0.0, 1.0 + 1e-6);
  }
}

/// Smallest lobe width that is not taken for a slip: 0.006 deg.
constexpr double kSmallestAlpha = 1e-4;

}  // namespace gonio::brdf
