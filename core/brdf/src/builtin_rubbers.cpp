#include "dielectrics.h"
#include "material_recipes.h"

namespace gonio::brdf::recipes {

void add_rubbers(std::vector<BuiltinMaterial>& list) {
  namespace d = dielectrics;
  Family rubber("rubber", list);
  const auto add = [&](const char* name, const char* description, const Opaque& recipe) {
    rubber.add(name, description, recipe.surface, recipe);
  };

  add("latex-natural", "natural latex sheet, amber",
      {.surface = d::natural_rubber(),
       .base = {0.66, 0.49, 0.27},
       .sigma = 0.1,
       .depth = {0.05, 0.14, 0.27},
       .gloss = {{0.50, 0.155}, {0.42, 0.32}}});
  add("neoprene-black", "black neoprene, smooth skin",
      {.surface = d::neoprene(),
       .base = {0.036, 0.035, 0.036},
       .sigma = 0.4,
       .gloss = {{0.45, 0.29}, {0.46, 0.52}}});
  add("silicone-red", "red silicone, mould finish",
      {.surface = d::silicone(),
       .base = {0.56, 0.072, 0.058},
       .sigma = 0.1,
       .gloss = {{0.62, 0.18}, {0.30, 0.37}}});
  add("epdm-blue", "blue EPDM granulate, worn",
      {.surface = d::epdm(), .base = {0.090, 0.185, 0.345}, .sigma = 0.7, .gloss = {{0.75, 0.56}}});
  add("tyre-black", "tyre sidewall, dusty",
      {.surface = d::natural_rubber(),
       .base = {0.060, 0.056, 0.050},
       .sigma = 0.8,
       .gloss = {{0.60, 0.48}},
       .haze = {0.20, 9.0, 1.8}});
}

}  // namespace gonio::brdf::recipes
