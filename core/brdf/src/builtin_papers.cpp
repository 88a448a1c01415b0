#include "dielectrics.h"
#include "material_recipes.h"

namespace gonio::brdf::recipes {

void add_papers(std::vector<BuiltinMaterial>& list) {
  namespace d = dielectrics;
  Family paper("paper", list);

  const Published fibre = d::cellulose();
  paper.add("bond-white", "white copy paper", fibre,
            Cloth{.fibre = fibre,
                  .diffuse = {0.74, 0.75, 0.78},
                  .sigma = 0.35,
                  .volume = {0.14, 0.14, 0.15},
                  .asymmetry = 0.1,
                  .gloss = {{0.55, 0.50}}});
  paper.add("kraft-brown", "brown kraft board", fibre,
            Cloth{.fibre = fibre,
                  .diffuse = {0.39, 0.265, 0.145},
                  .sigma = 0.45,
                  .volume = {0.09, 0.06, 0.035},
                  .asymmetry = 0.2,
                  .gloss = {{0.60, 0.38}}});
  paper.add("construction-red", "red sugar paper", fibre,
            Cloth{.fibre = fibre,
                  .diffuse = {0.49, 0.058, 0.060},
                  .sigma = 0.65,
                  .volume = {0.12, 0.020, 0.020},
                  .asymmetry = 0.0,
                  .backscatter = {0.03, 0.008, 0.008},
                  .backscatter_width = 0.3});
  const Published coating = d::acrylic_binder();
  paper.add("art-paper-coated", "coated art paper, cream, silk", coating,
            Opaque{.surface = coating,
                   .base = {0.88, 0.85, 0.77},
                   .sigma = 0.1,
                   .gloss = {{0.50, 0.105}, {0.34, 0.33}}});
  paper.add("photo-paper-gloss", "photographic paper, printed blue-green", coating,
            Opaque{.surface = coating,
                   .base = {0.125, 0.36, 0.41},
                   .depth = {0.05, 0.01, 0.01},
                   .gloss = {{0.80, 0.034}, {0.14, 0.14}}});
}

}  // namespace gonio::brdf::recipes
