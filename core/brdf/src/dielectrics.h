#pragma once

#include "optical_constants.h"

/// The transparent solids the built-in materials are made of.
namespace gonio::brdf::dielectrics {

using optical_constants::Published;
using optical_constants::transparent;

inline const char* const kPolymerHandbook =
    "Brandrup, Immergut, Grulke, Polymer Handbook, 4th ed. (1999), VI/571";
inline const char* const kKasarova = "Kasarova et al., Opt. Mater. 29, 1481 (2007)";
inline const char* const kPaintings = "Gettens and Stout, Painting Materials (1942)";
inline const char* const kMinerals = "Deer, Howie, Zussman, Rock-Forming Minerals, 2nd ed. (1992)";
inline const char* const kFibres =
    "Morton and Hearle, Physical Properties of Textile Fibres, 4th ed. (2008), ch. 24";

// Binders and varnishes
inline Published alkyd() { return transparent(1.53, 45.0, kPaintings); }
inline Published acrylic_binder() { return transparent(1.49, 55.0, kPolymerHandbook); }
inline Published linseed_oil() { return transparent(1.50, 43.0, kPaintings); }
inline Published nitrocellulose() { return transparent(1.51, 48.0, kPolymerHandbook); }
inline Published shellac() { return transparent(1.52, 46.0, kPaintings); }
inline Published polyurethane() { return transparent(1.55, 40.0, kPolymerHandbook); }
inline Published epoxy() { return transparent(1.57, 36.0, kPolymerHandbook); }

// Plastics and rubbers
inline Published pmma() { return transparent(1.491, 57.4, kKasarova); }
inline Published polystyrene() { return transparent(1.590, 30.9, kKasarova); }
inline Published polycarbonate() { return transparent(1.585, 29.9, kKasarova); }
inline Published abs() { return transparent(1.54, 36.0, kPolymerHandbook); }
inline Published polyethylene() { return transparent(1.51, 47.0, kPolymerHandbook); }
inline Published polypropylene() { return transparent(1.49, 50.0, kPolymerHandbook); }
inline Published pvc() { return transparent(1.54, 42.0, kPolymerHandbook); }
inline Published ptfe() { return transparent(1.35, 65.0, kPolymerHandbook); }
inline Published melamine() { return transparent(1.60, 32.0, kPolymerHandbook); }
inline Published phenolic() { return transparent(1.63, 28.0, kPolymerHandbook); }
inline Published natural_rubber() { return transparent(1.519, 44.0, kPolymerHandbook); }
inline Published neoprene() { return transparent(1.558, 38.0, kPolymerHandbook); }
inline Published silicone() { return transparent(1.41, 54.0, kPolymerHandbook); }
inline Published epdm() { return transparent(1.48, 48.0, kPolymerHandbook); }

// Glass, ceramics and stone
inline Published soda_lime() {
  return transparent(1.523, 58.6, "Rubin, Sol. Energy Mater. 12, 275 (1985)");
}
inline Published alumina() {
  return transparent(1.768, 72.2, "Malitson, J. Opt. Soc. Am. 52, 1377 (1962)");
}
inline Published silicon_nitride() {
  return transparent(2.02, 36.0, "Philipp, J. Electrochem. Soc. 120, 295 (1973)");
}
inline Published zirconia() {
  return transparent(2.16, 34.0, "Wood and Nassau, Appl. Opt. 21, 2978 (1982)");
}
inline Published rutile() {
  return transparent(2.613, 9.9, "DeVore, J. Opt. Soc. Am. 41, 416 (1951)");
}
inline Published calcite() { return transparent(1.60, 49.0, kMinerals); }
inline Published quartz() { return transparent(1.544, 69.9, kMinerals); }
inline Published obsidian() { return transparent(1.50, 60.0, kMinerals); }
inline Published feldspar() { return transparent(1.53, 60.0, kMinerals); }
inline Published mica() { return transparent(1.59, 45.0, kMinerals); }

// Fibres
inline Published cotton() { return transparent(1.55, 45.0, kFibres); }
inline Published flax() { return transparent(1.56, 45.0, kFibres); }
inline Published wool() { return transparent(1.55, 40.0, kFibres); }
inline Published silk() { return transparent(1.56, 40.0, kFibres); }
inline Published polyester() { return transparent(1.63, 30.0, kFibres); }
inline Published nylon_fibre() { return transparent(1.55, 42.0, kFibres); }
inline Published cellulose() { return transparent(1.54, 45.0, kFibres); }

}  // namespace gonio::brdf::dielectrics
