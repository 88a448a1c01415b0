#include "dielectrics.h"
#include "material_recipes.h"

namespace gonio::brdf::recipes {

void add_metals(std::vector<BuiltinMaterial>& list) {
  namespace oc = optical_constants;
  Family metal("metal", list);
  const auto add = [&](const char* name, const char* description, const Metal& recipe) {
    metal.add(name, description, recipe.metal, recipe);
  };

  add("gold-polished", "gold, polished by hand",
      {.metal = oc::gold(), .gloss = {{0.72, 0.045}, {0.24, 0.14}}});
  add("gold-satin", "gold, satin finish",
      {.metal = oc::gold(), .gloss = {{0.60, 0.22}, {0.34, 0.38}}});
  add("silver-polished", "silver, polished",
      {.metal = oc::silver(), .gloss = {{0.80, 0.028}}, .haze = {0.17, 180.0, 1.4}});
  add("silver-tarnished", "silver with a brown sulphide film",
      {.metal = oc::silver(),
       .gloss = {{0.55, 0.13}, {0.30, 0.30}},
       .tint = {0.72, 0.58, 0.42},
       .dull = {0.030, 0.025, 0.020}});
  add("copper-polished", "copper, mirror polish",
      {.metal = oc::copper(), .gloss = {{0.84, 0.020}, {0.12, 0.11}}});
  add("copper-brushed", "copper sheet, scoured",
      {.metal = oc::copper(), .gloss = {{0.55, 0.17}, {0.40, 0.34}}, .dull = {0.02, 0.012, 0.009}});
  add("brass-satin", "brass 70/30, satin",
      {.metal = oc::brass(), .gloss = {{0.66, 0.12}, {0.28, 0.29}}});
  add("gilding-metal-aged", "gilding metal 90/10, aged",
      {.metal = oc::gilding_metal(),
       .gloss = {{0.45, 0.25}, {0.40, 0.45}},
       .tint = {0.88, 0.82, 0.74},
       .dull = {0.040, 0.026, 0.016}});
  add("electrum-burnished", "gold-silver alloy, burnished",
      {.metal = oc::electrum(), .gloss = {{0.68, 0.075}, {0.27, 0.21}}});
  add("aluminium-foil", "aluminium foil, bright side",
      {.metal = oc::aluminium(), .gloss = {{0.60, 0.060}}, .haze = {0.36, 70.0, 1.5}});
  add("aluminium-blasted", "aluminium, bead-blasted",
      {.metal = oc::aluminium(),
       .gloss = {{0.50, 0.36}, {0.45, 0.56}},
       .tint = {0.93, 0.93, 0.93}});
  add("nickel-electroplate", "nickel, bright electroplate",
      {.metal = oc::nickel(), .gloss = {{0.82, 0.035}, {0.14, 0.16}}});
  add("chrome-plate", "chromium, mirror plate",
      {.metal = oc::chromium(), .gloss = {{0.92, 0.014}, {0.05, 0.08}}});
  add("iron-cast", "cast iron, sand skin",
      {.metal = oc::iron(),
       .gloss = {{0.35, 0.42}, {0.40, 0.66}},
       .tint = {0.62, 0.60, 0.58},
       .dull = {0.035, 0.031, 0.028}});
  add("steel-ground", "ferritic stainless steel, ground",
      {.metal = oc::stainless_steel(), .gloss = {{0.62, 0.105}, {0.33, 0.26}}});
  add("steel-oxidised", "steel with black oxide, oiled",
      {.metal = oc::iron(),
       .gloss = {{0.30, 0.19}, {0.35, 0.40}},
       .tint = {0.30, 0.29, 0.31},
       .dull = {0.018, 0.018, 0.020}});
  add("titanium-pickled", "titanium, pickled",
      {.metal = oc::titanium(), .gloss = {{0.52, 0.29}, {0.42, 0.48}}});
  add("tungsten-lapped", "tungsten, lapped",
      {.metal = oc::tungsten(), .gloss = {{0.70, 0.088}}, .haze = {0.26, 40.0, 1.4}});

  // Rutile stands for the amorphous oxide, whose index is a tenth lower.
  const oc::Published oxide = dielectrics::rutile();
  oc::Published titanium = oc::titanium();
  titanium.source += "; " + oxide.source;
  metal.add("titanium-anodised-gold", "titanium, anodised straw gold", titanium,
            Anodised{.film = {0.9 * oxide.index.n, 22.0},
                     .metal = titanium,
                     .gloss = {{0.50, 0.17}, {0.44, 0.31}}});

  oc::Published platinum = oc::platinum();
  platinum.source += "; lobe after Bagher et al., EGSR 2012";
  metal.add("platinum-satin", "platinum, satin", platinum,
            Fitted{.diffuse = {0.012, 0.011, 0.010},
                   .lobe = {.rho = {0.66, 0.66, 0.66},
                            .alpha = {0.150, 0.143, 0.138},
                            .p = {0.80, 0.82, 0.84},
                            .f0 = fresnel_reflectance(1.0, platinum.index),
                            .f1 = Rgb::Zero(),
                            .lambda = {1.0, 1.0, 1.0},
                            .c_g = {0.040, 0.040, 0.040},
                            .k_g = {6.2, 6.2, 6.2},
                            .theta0 = Rgb::Zero()}});
}

}  // namespace gonio::brdf::recipes
