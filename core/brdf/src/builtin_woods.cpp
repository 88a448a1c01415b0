#include "dielectrics.h"
#include "material_recipes.h"

namespace gonio::brdf::recipes {

void add_woods(std::vector<BuiltinMaterial>& list) {
  namespace d = dielectrics;
  Family wood("wood", list);
  const auto add = [&](const char* name, const char* description, const Opaque& recipe) {
    wood.add(name, description, recipe.surface, recipe);
  };

  add("cherry-varnished", "cherry, stained, oil varnish",
      {.surface = d::linseed_oil(),
       .base = {0.55, 0.30, 0.155},
       .sigma = 0.2,
       .depth = {0.10, 0.28, 0.46},
       .gloss = {{0.58, 0.070}, {0.34, 0.19}}});
  add("oak-oiled", "oak, oiled",
      {.surface = d::linseed_oil(),
       .base = {0.51, 0.36, 0.205},
       .sigma = 0.4,
       .depth = {0.03, 0.07, 0.14},
       .gloss = {{0.48, 0.25}, {0.42, 0.47}}});
  add("pine-raw", "pine, planed, untreated",
      {.surface = d::cellulose(),
       .base = {0.76, 0.59, 0.37},
       .sigma = 0.5,
       .gloss = {{0.55, 0.41}}});
  add("walnut-satin", "walnut, satin nitrocellulose lacquer",
      {.surface = d::nitrocellulose(),
       .base = {0.215, 0.130, 0.075},
       .sigma = 0.3,
       .depth = {0.04, 0.09, 0.15},
       .gloss = {{0.60, 0.14}, {0.33, 0.28}}});
  add("maple-gloss", "maple, polyurethane floor gloss",
      {.surface = d::polyurethane(),
       .base = {0.72, 0.56, 0.36},
       .sigma = 0.2,
       .depth = {0.02, 0.05, 0.11},
       .gloss = {{0.74, 0.038}, {0.21, 0.13}}});
  add("ebony-polished", "ebony, buffed with wax",
      {.surface = d::shellac(),
       .base = {0.035, 0.029, 0.026},
       .sigma = 0.3,
       .gloss = {{0.66, 0.092}},
       .haze = {0.27, 45.0, 1.5}});
  add("teak-oiled", "teak, oiled and weathered",
      {.surface = d::linseed_oil(),
       .base = {0.33, 0.205, 0.108},
       .sigma = 0.5,
       .depth = {0.05, 0.10, 0.17},
       .gloss = {{0.65, 0.34}}});
  add("mahogany-french-polish", "mahogany, French polish",
      {.surface = d::shellac(),
       .base = {0.375, 0.155, 0.085},
       .sigma = 0.2,
       .depth = {0.11, 0.34, 0.58},
       .gloss = {{0.82, 0.026}, {0.13, 0.12}}});
  add("oak-pickled", "oak, pickled white, matte",
      {.surface = d::acrylic_binder(),
       .base = {0.66, 0.60, 0.51},
       .sigma = 0.4,
       .gloss = {{0.50, 0.31}, {0.36, 0.54}}});
}

}  // namespace gonio::brdf::recipes
