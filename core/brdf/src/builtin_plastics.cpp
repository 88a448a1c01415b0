#include "dielectrics.h"
#include "material_recipes.h"

namespace gonio::brdf::recipes {

void add_plastics(std::vector<BuiltinMaterial>& list) {
  namespace d = dielectrics;
  Family plastic("plastic", list);
  const auto add = [&](const char* name, const char* description, const Opaque& recipe) {
    plastic.add(name, description, recipe.surface, recipe);
  };

  add("grey-abs", "grey ABS, fine texture",
      {.surface = d::abs(), .base = {0.245, 0.250, 0.262}, .gloss = {{0.55, 0.21}, {0.38, 0.36}}});
  add("black-abs-textured", "black ABS, leather texture",
      {.surface = d::abs(),
       .base = {0.020, 0.021, 0.024},
       .sigma = 0.2,
       .gloss = {{0.70, 0.26}, {0.20, 0.44}}});
  add("red-pmma", "red acrylic sheet",
      {.surface = d::pmma(), .base = {0.52, 0.030, 0.035}, .gloss = {{0.90, 0.012}, {0.06, 0.09}}});
  add("blue-pmma", "blue acrylic sheet, scratched",
      {.surface = d::pmma(),
       .base = {0.030, 0.085, 0.47},
       .gloss = {{0.62, 0.020}},
       .haze = {0.34, 220.0, 1.35}});
  add("opal-pmma", "white opal acrylic sheet",
      {.surface = d::pmma(), .base = {0.80, 0.83, 0.85}, .gloss = {{0.86, 0.016}, {0.10, 0.06}}});
  add("green-polystyrene", "green polystyrene, moulded gloss",
      {.surface = d::polystyrene(),
       .base = {0.045, 0.31, 0.095},
       .gloss = {{0.76, 0.042}, {0.20, 0.15}}});
  add("yellow-abs", "yellow ABS brick",
      {.surface = d::abs(), .base = {0.83, 0.55, 0.030}, .gloss = {{0.80, 0.030}, {0.15, 0.19}}});
  add("natural-polyethylene", "uncoloured polyethylene, waxy",
      {.surface = d::polyethylene(),
       .base = {0.70, 0.72, 0.71},
       .gloss = {{0.55, 0.18}},
       .haze = {0.35, 26.0, 1.6}});
  add("white-ptfe", "sintered PTFE",
      {.surface = d::ptfe(),
       .base = {0.965, 0.970, 0.970},
       .sigma = 0.25,
       .gloss = {{0.75, 0.33}}});
  add("grey-pvc", "grey PVC pipe",
      {.surface = d::pvc(), .base = {0.325, 0.340, 0.355}, .gloss = {{0.66, 0.11}, {0.26, 0.25}}});
  add("black-polycarbonate", "black polycarbonate, polished",
      {.surface = d::polycarbonate(),
       .base = {0.012, 0.012, 0.013},
       .gloss = {{0.88, 0.022}, {0.08, 0.10}}});
  add("pink-polypropylene", "pink polypropylene, satin",
      {.surface = d::polypropylene(),
       .base = {0.79, 0.34, 0.46},
       .gloss = {{0.66, 0.145}, {0.26, 0.33}}});
  add("violet-polycarbonate", "violet polycarbonate, satin moulded",
      {.surface = d::polycarbonate(),
       .base = {0.215, 0.062, 0.36},
       .gloss = {{0.55, 0.085}, {0.40, 0.22}}});
  add("teal-melamine", "blue-green melamine tableware",
      {.surface = d::melamine(),
       .base = {0.055, 0.285, 0.31},
       .gloss = {{0.72, 0.060}, {0.23, 0.20}}});
}

}  // namespace gonio::brdf::recipes
