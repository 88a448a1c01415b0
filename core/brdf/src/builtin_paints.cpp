#include "dielectrics.h"
#include "material_recipes.h"

namespace gonio::brdf::recipes {

void add_paints(std::vector<BuiltinMaterial>& list) {
  namespace d = dielectrics;
  Family paint("paint", list);
  const auto add = [&](const char* name, const char* description, const Opaque& recipe) {
    paint.add(name, description, recipe.surface, recipe);
  };

  add("white-gloss-enamel", "white alkyd enamel, brushed, high gloss",
      {.surface = d::alkyd(), .base = {0.91, 0.90, 0.86}, .gloss = {{0.75, 0.035}, {0.20, 0.12}}});
  add("ivory-wall-latex", "ivory acrylic latex, matte",
      {.surface = d::acrylic_binder(),
       .base = {0.87, 0.81, 0.66},
       .sigma = 0.35,
       .gloss = {{0.80, 0.46}}});
  add("eggshell-grey", "light grey acrylic, eggshell",
      {.surface = d::acrylic_binder(),
       .base = {0.61, 0.62, 0.60},
       .sigma = 0.2,
       .gloss = {{0.55, 0.27}, {0.35, 0.45}}});
  add("signal-red-enamel", "red alkyd enamel, gloss",
      {.surface = d::alkyd(),
       .base = {0.62, 0.055, 0.040},
       .gloss = {{0.70, 0.055}, {0.25, 0.17}}});
  add("navy-satin", "dark blue alkyd, satin",
      {.surface = d::alkyd(),
       .base = {0.028, 0.048, 0.145},
       .gloss = {{0.60, 0.16}, {0.35, 0.31}}});
  add("blackboard-paint", "black slate paint, dead matte",
      {.surface = d::acrylic_binder(),
       .base = {0.046, 0.048, 0.047},
       .sigma = 0.6,
       .gloss = {{0.85, 0.58}}});
  add("leaf-green-semigloss", "green alkyd, semi-gloss",
      {.surface = d::alkyd(),
       .base = {0.105, 0.345, 0.075},
       .gloss = {{0.68, 0.095}, {0.25, 0.24}}});
  add("traffic-yellow", "yellow road paint with coarse filler",
      {.surface = d::alkyd(),
       .base = {0.78, 0.53, 0.045},
       .sigma = 0.55,
       .gloss = {{0.50, 0.39}, {0.40, 0.62}}});
  add("iron-oxide-primer", "red-brown iron oxide primer",
      {.surface = d::linseed_oil(),
       .base = {0.33, 0.095, 0.055},
       .sigma = 0.45,
       .gloss = {{0.75, 0.37}}});
  add("orange-gloss", "orange alkyd, sprayed",
      {.surface = d::alkyd(), .base = {0.80, 0.26, 0.035}, .gloss = {{0.82, 0.024}, {0.12, 0.14}}});
  add("sky-blue-enamel", "light blue oil enamel, aged",
      {.surface = d::linseed_oil(),
       .base = {0.33, 0.52, 0.72},
       .gloss = {{0.60, 0.075}},
       .haze = {0.30, 90.0, 1.25}});
  add("chalk-pink", "pink limewash",
      {.surface = d::acrylic_binder(),
       .base = {0.81, 0.55, 0.53},
       .sigma = 0.8,
       .gloss = {{0.40, 0.66}}});

  Published binder = d::acrylic_binder();
  binder.source += "; lobe after Bagher et al., EGSR 2012";
  paint.add("turquoise-latex", "turquoise latex, semi-gloss", binder,
            Fitted{.diffuse = {0.10, 0.42, 0.45},
                   .sigma = 0.1,
                   .lobe = {.rho = {0.60, 0.62, 0.64},
                            .alpha = {0.115, 0.108, 0.102},
                            .p = {0.95, 0.92, 0.90},
                            .f0 = {0.038, 0.039, 0.040},
                            .f1 = Rgb::Zero(),
                            .lambda = {1.0, 1.0, 1.0},
                            .c_g = {0.045, 0.045, 0.045},
                            .k_g = {6.0, 6.0, 6.0},
                            .theta0 = Rgb::Zero()}});
}

}  // namespace gonio::brdf::recipes
