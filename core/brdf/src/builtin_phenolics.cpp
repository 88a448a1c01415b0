#include "dielectrics.h"
#include "material_recipes.h"

namespace gonio::brdf::recipes {

void add_phenolics(std::vector<BuiltinMaterial>& list) {
  namespace d = dielectrics;
  Family phenolic("phenolic", list);
  const auto add = [&](const char* name, const char* description, const Opaque& recipe) {
    phenolic.add(name, description, recipe.surface, recipe);
  };

  add("phenolic-white", "cue ball, polished",
      {.surface = d::phenolic(),
       .base = {0.79, 0.74, 0.60},
       .gloss = {{0.86, 0.022}, {0.10, 0.11}}});
  add("phenolic-black", "black billiard ball, played",
      {.surface = d::phenolic(),
       .base = {0.019, 0.018, 0.018},
       .gloss = {{0.72, 0.038}, {0.22, 0.18}}});
  add("phenolic-yellow", "yellow billiard ball, polished",
      {.surface = d::phenolic(),
       .base = {0.74, 0.43, 0.040},
       .gloss = {{0.88, 0.018}},
       .haze = {0.09, 110.0, 1.4}});
  add("phenolic-red", "red billiard ball, polished",
      {.surface = d::phenolic(),
       .base = {0.47, 0.034, 0.026},
       .gloss = {{0.82, 0.029}, {0.13, 0.13}}});
  add("phenolic-green", "green billiard ball, dull",
      {.surface = d::phenolic(),
       .base = {0.030, 0.155, 0.068},
       .gloss = {{0.55, 0.082}, {0.38, 0.25}}});
  add("phenolic-blue", "blue billiard ball, polished",
      {.surface = d::phenolic(),
       .base = {0.024, 0.052, 0.225},
       .gloss = {{0.85, 0.025}, {0.09, 0.16}}});
  add("phenolic-maroon", "maroon billiard ball, waxed",
      {.surface = d::phenolic(),
       .base = {0.135, 0.022, 0.026},
       .gloss = {{0.66, 0.055}},
       .haze = {0.28, 55.0, 1.45}});
}

}  // namespace gonio::brdf::recipes
