#include "optical_constants.h"

namespace gonio::brdf::optical_constants {
namespace {

const char* const kNobleMetals = "n, k: Johnson and Christy, Phys. Rev. B 6, 4370 (1972)";
const char* const kTransitionMetals = "n, k: Johnson and Christy, Phys. Rev. B 9, 5056 (1974)";
const char* const kCopperZinc = "n, k: Querry, Contractor Report CRDC-CR-85034 (1985)";

Rgb rgb(double r, double g, double b) { return {r, g, b}; }

}  // namespace

Published gold() { return {{rgb(0.188, 0.544, 1.332), rgb(3.403, 2.231, 1.869)}, kNobleMetals}; }
Published silver() { return {{rgb(0.057, 0.054, 0.047), rgb(4.254, 3.429, 2.803)}, kNobleMetals}; }
Published copper() { return {{rgb(0.275, 1.116, 1.247), rgb(3.372, 2.596, 2.456)}, kNobleMetals}; }
Published aluminium() {
  return {{rgb(1.430, 0.939, 0.686), rgb(7.507, 6.420, 5.635)},
          "n, k: Rakic, Appl. Opt. 34, 4755 (1995)"};
}
Published nickel() {
  return {{rgb(1.990, 1.878, 1.765), rgb(4.094, 3.495, 3.048)}, kTransitionMetals};
}
Published chromium() {
  return {{rgb(3.145, 3.034, 2.456), rgb(3.312, 3.330, 3.210)}, kTransitionMetals};
}
Published iron() {
  return {{rgb(2.892, 2.895, 2.646), rgb(3.065, 2.918, 2.805)}, kTransitionMetals};
}
Published titanium() {
  return {{rgb(2.698, 2.479, 2.305), rgb(3.757, 3.351, 3.082)}, kTransitionMetals};
}
Published tungsten() {
  return {{rgb(3.618, 3.497, 3.325), rgb(2.911, 2.719, 2.574)},
          "n, k: Weaver, Olson, Lynch, Phys. Rev. B 12, 1293 (1975)"};
}
Published platinum() {
  return {{rgb(2.310, 2.046, 1.887), rgb(4.148, 3.603, 3.224)},
          "n, k: Rakic et al., Appl. Opt. 37, 5271 (1998), Lorentz-Drude"};
}
Published stainless_steel() {
  return {{rgb(2.141, 1.846, 1.561), rgb(3.420, 3.113, 2.839)},
          "n, k: Karlsson and Ribbing, J. Appl. Phys. 53, 6340 (1982), ferritic"};
}
Published brass() { return {{rgb(0.445, 0.568, 0.947), rgb(3.522, 2.588, 1.920)}, kCopperZinc}; }
Published gilding_metal() {
  return {{rgb(0.327, 0.652, 0.948), rgb(3.226, 2.275, 2.012)}, kCopperZinc};
}
Published electrum() {
  return {{rgb(0.307, 0.352, 0.592), rgb(3.819, 2.859, 2.071)},
          "n, k: Rioux et al., Adv. Opt. Mater. 2, 176 (2014)"};
}

Published transparent(double nd, double abbe, const std::string& source) {
  // Fraunhofer lines in um: F 0.4861, d 0.5876, C 0.6563; abbe = (nd - 1) / (nF - nC).
  const auto inverse_square = [](double um) { return 1.0 / (um * um); };
  const double slope = (nd - 1.0) / abbe / (inverse_square(0.4861) - inverse_square(0.6563));
  const auto at = [&](double um) {
    return nd + slope * (inverse_square(um) - inverse_square(0.5876));
  };
  return {{rgb(at(0.630), at(0.532), at(0.465)), Rgb::Zero()}, "n: " + source};
}

}  // namespace gonio::brdf::optical_constants
