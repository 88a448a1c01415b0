#include "dielectrics.h"
#include "material_recipes.h"

namespace gonio::brdf::recipes {

void add_fabrics(std::vector<BuiltinMaterial>& list) {
  namespace d = dielectrics;
  Family fabric("fabric", list);
  const auto add = [&](const char* name, const char* description, const Cloth& recipe) {
    fabric.add(name, description, recipe.fibre, recipe);
  };

  add("white-cotton", "white cotton, plain weave",
      {.fibre = d::cotton(),
       .diffuse = {0.68, 0.68, 0.67},
       .sigma = 0.5,
       .volume = {0.22, 0.22, 0.22},
       .asymmetry = 0.2,
       .gloss = {{0.35, 0.55}}});
  add("natural-linen", "unbleached linen",
      {.fibre = d::flax(),
       .diffuse = {0.42, 0.35, 0.25},
       .sigma = 0.6,
       .volume = {0.12, 0.10, 0.07},
       .asymmetry = 0.3,
       .gloss = {{0.45, 0.42}}});
  add("red-felt", "red wool felt",
      {.fibre = d::wool(),
       .diffuse = {0.36, 0.025, 0.030},
       .sigma = 0.8,
       .volume = {0.20, 0.020, 0.022},
       .asymmetry = -0.1,
       .sheen = {0.10, 0.020, 0.020},
       .sheen_roughness = 0.45});
  add("blue-denim", "indigo denim twill",
      {.fibre = d::cotton(),
       .diffuse = {0.045, 0.070, 0.145},
       .sigma = 0.7,
       .volume = {0.04, 0.05, 0.08},
       .asymmetry = 0.1,
       .backscatter = {0.015, 0.018, 0.026},
       .backscatter_width = 0.25,
       .gloss = {{0.40, 0.60}}});
  add("black-velvet", "black cotton velvet",
      {.fibre = d::cotton(),
       .diffuse = {0.008, 0.008, 0.009},
       .sigma = 1.0,
       .volume = {0.006, 0.006, 0.007},
       .asymmetry = 0.2,
       .sheen = {0.060, 0.058, 0.062},
       .sheen_roughness = 0.22});
  add("pink-satin", "pink silk satin",
      {.fibre = d::silk(),
       .diffuse = {0.43, 0.20, 0.25},
       .sigma = 0.2,
       .volume = {0.10, 0.05, 0.06},
       .asymmetry = 0.5,
       .gloss = {{0.55, 0.19}, {0.40, 0.37}},
       .gloss_tint = {1.0, 0.90, 0.92}});
  add("green-silk", "green silk taffeta",
      {.fibre = d::silk(),
       .diffuse = {0.060, 0.235, 0.085},
       .sigma = 0.3,
       .volume = {0.03, 0.08, 0.04},
       .asymmetry = 0.4,
       .gloss = {{0.60, 0.26}, {0.30, 0.46}}});
  add("grey-flannel", "grey wool flannel",
      {.fibre = d::wool(),
       .diffuse = {0.150, 0.148, 0.155},
       .sigma = 0.8,
       .volume = {0.07, 0.07, 0.07},
       .asymmetry = 0.1,
       .sheen = {0.05, 0.05, 0.05},
       .sheen_roughness = 0.55,
       .gloss = {{0.20, 0.60}}});
  add("brown-tweed", "brown wool tweed",
      {.fibre = d::wool(),
       .diffuse = {0.165, 0.098, 0.056},
       .sigma = 0.9,
       .volume = {0.06, 0.04, 0.025},
       .asymmetry = -0.2,
       .backscatter = {0.030, 0.018, 0.010},
       .backscatter_width = 0.4});
  add("orange-fleece", "orange polyester fleece",
      {.fibre = d::polyester(),
       .diffuse = {0.56, 0.175, 0.030},
       .sigma = 0.7,
       .volume = {0.22, 0.09, 0.02},
       .asymmetry = 0.3,
       .sheen = {0.08, 0.05, 0.03},
       .sheen_roughness = 0.35});
  add("blue-nylon", "blue nylon ripstop, calendered",
      {.fibre = d::nylon_fibre(),
       .diffuse = {0.030, 0.105, 0.33},
       .sigma = 0.2,
       .volume = {0.02, 0.04, 0.10},
       .asymmetry = 0.4,
       .gloss = {{0.50, 0.15}, {0.42, 0.32}}});
  add("black-sateen", "black polyester sateen",
      {.fibre = d::polyester(),
       .diffuse = {0.016, 0.015, 0.018},
       .sigma = 0.2,
       .volume = {0.010, 0.010, 0.011},
       .asymmetry = 0.5,
       .gloss = {{0.58, 0.23}, {0.35, 0.44}}});
}

}  // namespace gonio::brdf::recipes
