#include "dielectrics.h"
#include "material_recipes.h"

namespace gonio::brdf::recipes {

void add_ceramics(std::vector<BuiltinMaterial>& list) {
  namespace d = dielectrics;
  Family ceramic("ceramic", list);
  const auto add = [&](const char* name, const char* description, const Opaque& recipe) {
    ceramic.add(name, description, recipe.surface, recipe);
  };

  add("porcelain-glazed", "white porcelain, clear glaze",
      {.surface = d::soda_lime(),
       .base = {0.83, 0.82, 0.78},
       .gloss = {{0.88, 0.017}, {0.08, 0.08}}});
  add("terracotta", "unglazed terracotta",
      {.surface = d::feldspar(),
       .base = {0.48, 0.215, 0.118},
       .sigma = 0.8,
       .gloss = {{0.35, 0.60}}});
  add("white-marble", "white marble, polished",
      {.surface = d::calcite(),
       .base = {0.76, 0.75, 0.72},
       .gloss = {{0.58, 0.062}, {0.32, 0.23}}});
  add("black-obsidian", "obsidian, broken face",
      {.surface = d::obsidian(),
       .base = {0.010, 0.010, 0.011},
       .gloss = {{0.78, 0.032}},
       .haze = {0.18, 130.0, 1.45}});
  add("pink-jasper", "pink jasper, tumbled",
      {.surface = d::quartz(),
       .base = {0.45, 0.215, 0.175},
       .gloss = {{0.62, 0.115}, {0.30, 0.30}}});
  add("alumina-white", "sintered alumina, as fired",
      {.surface = d::alumina(),
       .base = {0.90, 0.90, 0.88},
       .sigma = 0.2,
       .gloss = {{0.55, 0.28}, {0.35, 0.50}}});
  add("silicon-nitride", "silicon nitride bearing ball, lapped",
      {.surface = d::silicon_nitride(),
       .base = {0.052, 0.053, 0.057},
       .gloss = {{0.80, 0.046}, {0.14, 0.14}}});
  add("zirconia-ivory", "zirconia, ground",
      {.surface = d::zirconia(),
       .base = {0.80, 0.76, 0.64},
       .gloss = {{0.50, 0.20}, {0.42, 0.40}}});
  add("slate", "roofing slate, split face",
      {.surface = d::mica(),
       .base = {0.085, 0.092, 0.102},
       .sigma = 0.5,
       .gloss = {{0.50, 0.36}, {0.38, 0.60}}});
  add("blue-tile", "cobalt blue tile, crazed glaze",
      {.surface = d::soda_lime(),
       .base = {0.042, 0.088, 0.36},
       .depth = {0.06, 0.04, 0.01},
       .gloss = {{0.80, 0.027}},
       .haze = {0.15, 60.0, 1.3}});
}

}  // namespace gonio::brdf::recipes
