#pragma once

#include <vector>

#include "gonio/brdf/directions.h"
#include "gonio/instrument/instrument.h"

namespace gonio::calibration {

/// BRDF of the white in one pose, one colour.
struct WhiteReading {
  brdf::DirectionPair directions;  ///< sample frame
  double brdf = 0.0;               ///< as the rig reduces it, 1/sr
};

/// Share of the light from 45 deg that a white throws back into all directions.
struct HemisphericalReflectance {
  double found = 0.0;        ///< as the poses say
  double sigma = 0.0;        ///< of `found`, by how the poses scatter; the certificate's is apart
  double certificate = 0.0;  ///< as its table says
};

/// From the BRDF at a few poses: the certificate's table times a + b (sin^2 theta_i + sin^2
/// theta_o), which is the same with light and camera exchanged, fitted to all poses alike and
/// integrated over the hemisphere. With poses that are too alike for b, it is 0.
///
/// As the scale of every BRDF is that of the white's own certificate, `found` over `certificate` is
/// a matter of the rig: of the constant, and of whatever goes wrong smoothly with the angles. The
/// mean over all poses knows it several times better than any of them.
///
/// `readings`  At least one, lit and seen from the front.
/// Threads     Any.
HemisphericalReflectance hemispherical_reflectance(const instrument::WhiteReference& white,
                                                   int channel,
                                                   const std::vector<WhiteReading>& readings);

}  // namespace gonio::calibration
