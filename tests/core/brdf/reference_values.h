#pragma once

#include "gonio/brdf/fresnel.h"

/// What the tests of several models measure against.
namespace gonio::brdf::testing {

inline constexpr double kRounding = 1e-12;   ///< double arithmetic on values of order 1
inline constexpr double kCurveError = 1e-6;  ///< RgbCurve's promise for Fresnel factors

inline const RefractiveIndex kGold{{0.188, 0.544, 1.332}, {3.403, 2.231, 1.869}};
inline const RefractiveIndex kSilver{{0.057, 0.054, 0.047}, {4.254, 3.429, 2.803}};

}  // namespace gonio::brdf::testing
