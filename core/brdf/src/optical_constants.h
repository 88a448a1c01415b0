#pragma once

#include <string>

#include "gonio/brdf/fresnel.h"

namespace gonio::brdf::optical_constants {

/// A refractive index at 630, 532 and 465 nm (R, G, B) and where it was published.
struct Published {
  RefractiveIndex index;
  std::string source;
};

// Metals, interpolated linearly in wavelength between the published values.
Published gold();
Published silver();
Published copper();
Published aluminium();
Published nickel();
Published chromium();
Published iron();
Published titanium();
Published tungsten();
Published platinum();
Published stainless_steel();
Published brass();          ///< 70 % Cu, 30 % Zn
Published gilding_metal();  ///< 90 % Cu, 10 % Zn
Published electrum();       ///< 60 % Au, 40 % Ag

/// A transparent solid: Cauchy dispersion through the index at 587.6 nm with the Abbe number.
Published transparent(double nd, double abbe, const std::string& source);

}  // namespace gonio::brdf::optical_constants
