#include "dielectrics.h"
#include "material_recipes.h"

namespace gonio::brdf::recipes {

void add_metallic_paints(std::vector<BuiltinMaterial>& list) {
  namespace d = dielectrics;
  namespace oc = optical_constants;
  Family paint("metallic-paint", list);
  const auto add = [&](const char* name, const char* description, const Flakes& recipe) {
    Published constants = recipe.flake;
    constants.source += "; " + recipe.coat.source;
    paint.add(name, description, constants, recipe);
  };

  add("silver-fine", "silver car paint, fine flake",
      {.coat = d::polyurethane(),
       .surface = {{0.90, 0.018}},
       .flake = oc::aluminium(),
       .flakes = {{0.45, 0.16}, {0.30, 0.33}},
       .tint = {0.90, 0.91, 0.92},
       .base = {0.20, 0.20, 0.21}});
  add("silver-coarse", "silver wheel paint, coarse flake",
      {.coat = d::polyurethane(),
       .surface = {{0.70, 0.050}, {0.20, 0.16}},
       .flake = oc::aluminium(),
       .flakes = {{0.35, 0.09}, {0.35, 0.24}},
       .base = {0.12, 0.12, 0.12}});
  add("gold-bronze-powder", "brass powder in shellac",
      {.coat = d::shellac(),
       .surface = {{0.40, 0.20}, {0.45, 0.42}},
       .flake = oc::brass(),
       .flakes = {{0.35, 0.19}, {0.40, 0.38}},
       .base = {0.22, 0.14, 0.05}});
  add("blue-metallic", "blue metallic car paint",
      {.coat = d::polyurethane(),
       .surface = {{0.92, 0.015}},
       .flake = oc::aluminium(),
       .flakes = {{0.28, 0.19}, {0.20, 0.36}},
       .tint = {0.20, 0.36, 0.85},
       .base = {0.020, 0.048, 0.19}});
  add("red-candy", "red candy over silver",
      {.coat = d::polyurethane(),
       .surface = {{0.88, 0.024}, {0.08, 0.12}},
       .flake = oc::aluminium(),
       .flakes = {{0.40, 0.13}, {0.30, 0.30}},
       .base = {0.10, 0.08, 0.08},
       .depth = {0.10, 1.15, 1.05}});
  add("green-metallic", "dark green metallic car paint",
      {.coat = d::polyurethane(),
       .surface = {{0.85, 0.032}, {0.10, 0.18}},
       .flake = oc::aluminium(),
       .flakes = {{0.22, 0.22}, {0.22, 0.41}},
       .tint = {0.22, 0.52, 0.28},
       .base = {0.012, 0.065, 0.026}});
  add("graphite-metallic", "charcoal metallic, satin coat",
      {.coat = d::acrylic_binder(),
       .surface = {{0.55, 0.11}, {0.35, 0.27}},
       .flake = oc::iron(),
       .flakes = {{0.35, 0.21}, {0.30, 0.44}},
       .tint = {0.75, 0.75, 0.78},
       .base = {0.020, 0.020, 0.022}});
  add("copper-metallic", "copper metallic car paint",
      {.coat = d::polyurethane(),
       .surface = {{0.86, 0.040}, {0.08, 0.15}},
       .flake = oc::copper(),
       .flakes = {{0.40, 0.15}, {0.28, 0.31}},
       .base = {0.16, 0.055, 0.025}});
  add("purple-metallic", "purple metallic nail lacquer",
      {.coat = d::nitrocellulose(),
       .surface = {{0.72, 0.058}, {0.20, 0.20}},
       .flake = oc::aluminium(),
       .flakes = {{0.30, 0.26}},
       .tint = {0.52, 0.18, 0.62},
       .base = {0.085, 0.018, 0.115}});
  add("radiator-aluminium", "heat-proof aluminium paint, leafing",
      {.coat = d::alkyd(),
       .surface = {{0.25, 0.30}},
       .flake = oc::aluminium(),
       .flakes = {{0.42, 0.27}, {0.45, 0.46}},
       .tint = {0.80, 0.80, 0.80},
       .base = {0.25, 0.25, 0.25}});
  add("nickel-lacquer", "nickel powder in clear lacquer, bright",
      {.coat = d::nitrocellulose(),
       .surface = {{0.80, 0.028}},
       .flake = oc::nickel(),
       .flakes = {{0.60, 0.055}, {0.30, 0.17}},
       .base = {0.05, 0.05, 0.05}});
  add("gold-mirror-lacquer", "gold-tinted lacquer on silvered plastic",
      {.coat = d::nitrocellulose(),
       .surface = {{0.92, 0.016}},
       .flake = oc::silver(),
       .flakes = {{0.75, 0.026}, {0.22, 0.10}},
       .depth = {0.02, 0.11, 0.50}});

  const Published rutile = d::rutile();
  const auto add_pearl = [&](const char* name, const char* description, const Pearl& recipe) {
    Published constants = rutile;
    constants.source += "; " + recipe.platelet.source + "; " + recipe.coat.source;
    paint.add(name, description, constants, recipe);
  };
  add_pearl("pearl-white", "silver-white rutile-mica pearl over white",
            {.coat = d::polyurethane(),
             .surface = {{0.90, 0.020}},
             .film = {rutile.index.n, 58.0},
             .platelet = d::mica(),
             .platelets = {{0.45, 0.15}, {0.25, 0.32}},
             .base = {0.78, 0.78, 0.76}});
  add_pearl("pearl-blue-shift", "blue rutile-mica interference paint over black",
            {.coat = d::polyurethane(),
             .surface = {{0.84, 0.034}, {0.10, 0.14}},
             .film = {rutile.index.n, 128.0},
             .platelet = d::mica(),
             .platelets = {{0.50, 0.17}, {0.25, 0.34}},
             .base = {0.020, 0.022, 0.030}});
}

}  // namespace gonio::brdf::recipes
