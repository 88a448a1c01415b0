#pragma once

#include <algorithm>
#include <array>

#include "gonio/brdf/merl_lattice.h"
#include "gonio/brdf/shading_geometry.h"
#include "gonio/units/angle.h"

namespace gonio::brdf {

/// cos(90 deg) comes out as 6e-17: a direction that lies in the horizon plane by construction must
/// not count as above it because of rounding.
constexpr double kHorizonRounding = 1e-14;

inline bool above_horizon(const SinCos& theta_h, const SinCos& theta_d, double cos_phi_d) {
  const double common = theta_h.cosine * theta_d.cosine;
  const double split = theta_h.sine * theta_d.sine * cos_phi_d;
  return std::min(common - split, common + split) > kHorizonRounding;
}

namespace lattice {

/// Sines and cosines of every index of the three axes: 360 pairs stand for 1.4 M cells.
struct LatticeSinCos {
  std::array<SinCos, kThetaH> theta_h;
  std::array<SinCos, kThetaD> theta_d;
  std::array<SinCos, kPhiD> phi_d;

  explicit LatticeSinCos(IndexConvention convention) {
    for (std::size_t i = 0; i < kPhiD; ++i) {
      const int index = static_cast<int>(i);
      const int polar = std::min(index, static_cast<int>(kThetaH) - 1);
      const HalfDiff angles = angles_of({polar, polar, index}, convention);
      phi_d[i] = SinCos(angles.phi_d);
      if (i < kThetaH) theta_h[i] = SinCos(angles.theta_h);
      if (i < kThetaD) theta_d[i] = SinCos(angles.theta_d);
    }
  }
};

}  // namespace lattice
}  // namespace gonio::brdf
