#pragma once

#include <Eigen/Core>

namespace gonio::render {

/// CIE L*a*b* (1976): x = L*, y = a*, z = b*.
using Lab = Eigen::Array3d;

/// Linear RGB in [0, 1] with sRGB primaries and white D65 (IEC 61966-2-1) to L*a*b* relative to
/// that white, so that (1, 1, 1) is L* = 100, a* = b* = 0.
Lab lab_from_linear_srgb(const Eigen::Array3d& rgb);

/// The inverse; values outside [0, 1] are colours sRGB cannot show.
Eigen::Array3d linear_srgb_from_lab(const Lab& lab);

/// Colour difference CIEDE2000 with k_L = k_C = k_H = 1.
/// Source   CIE 142-2001; Sharma, Wu, Dalal, "The CIEDE2000 Color-Difference Formula:
///          Implementation Notes, Supplementary Test Data, and Mathematical Observations",
///          Color Research and Application 30(1), 2005, equations 2 to 22.
double delta_e_2000(const Lab& first, const Lab& second);

/// The sRGB transfer curve, per value in [0, 1].
double srgb_encode(double linear);

}  // namespace gonio::render
