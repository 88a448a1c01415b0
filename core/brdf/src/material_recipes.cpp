#include "material_recipes.h"

#include <utility>

#include "gonio/brdf/analytic_models.h"

namespace gonio::brdf::recipes {
namespace {

class Parts {
 public:
  void add(const Rgb& share, std::shared_ptr<const BrdfModel> model) {
    parts_.push_back({share, std::move(model)});
  }
  void add(double share, std::shared_ptr<const BrdfModel> model) {
    add(Rgb::Constant(share), std::move(model));
  }
  void add_gloss(const std::vector<Gloss>& lobes, const RefractiveIndex& index, const Rgb& tint) {
    for (const Gloss& lobe : lobes) {
      add(lobe.share, std::make_shared<Ggx>(lobe.alpha, index, tint));
    }
  }
  void add_haze(const Haze& haze, const RefractiveIndex& index, const Rgb& tint) {
    if (haze.share == 0.0) return;
    add(haze.share, std::make_shared<AbcLobe>(AbcLobe::normalised(haze.b, haze.c, index, tint)));
  }
  std::shared_ptr<const BrdfModel> mixture() {
    return std::make_shared<Mixture>(std::move(parts_));
  }

 private:
  std::vector<Mixture::Part> parts_;
};

bool any(const Rgb& value) { return (value > 0.0).any(); }

}  // namespace

std::shared_ptr<const BrdfModel> model_of(const Opaque& recipe) {
  const RefractiveIndex& index = recipe.surface.index;
  Parts parts;
  // Dispersion is left to the reflection; what goes through sees the green index.
  parts.add(1.0, std::make_shared<CoatedDiffuse>(Coat{index.n[1], recipe.depth}, recipe.base,
                                                 recipe.sigma));
  parts.add_gloss(recipe.gloss, index, Rgb::Ones());
  parts.add_haze(recipe.haze, index, Rgb::Ones());
  return parts.mixture();
}

std::shared_ptr<const BrdfModel> model_of(const Metal& recipe) {
  Parts parts;
  parts.add_gloss(recipe.gloss, recipe.metal.index, recipe.tint);
  parts.add_haze(recipe.haze, recipe.metal.index, recipe.tint);
  if (any(recipe.dull)) parts.add(1.0, std::make_shared<RoughDiffuse>(recipe.dull, 0.6));
  return parts.mixture();
}

std::shared_ptr<const BrdfModel> model_of(const Cloth& recipe) {
  Parts parts;
  parts.add(1.0, std::make_shared<RoughDiffuse>(recipe.diffuse, recipe.sigma));
  if (any(recipe.volume)) {
    parts.add(1.0, std::make_shared<VolumeScatter>(recipe.volume, recipe.asymmetry));
  }
  if (any(recipe.sheen)) {
    parts.add(1.0, std::make_shared<Sheen>(recipe.sheen_roughness, recipe.sheen));
  }
  if (any(recipe.backscatter)) {
    parts.add(1.0, std::make_shared<Backscatter>(recipe.backscatter, recipe.backscatter_width));
  }
  parts.add_gloss(recipe.gloss, recipe.fibre.index, recipe.gloss_tint);
  return parts.mixture();
}

std::shared_ptr<const BrdfModel> model_of(const Flakes& recipe) {
  const Coat coat{recipe.coat.index.n[1], recipe.depth};
  Parts parts;
  parts.add_gloss(recipe.surface, recipe.coat.index, Rgb::Ones());
  double uncovered = 1.0;
  for (const Gloss& lobe : recipe.flakes) {
    parts.add(lobe.share,
              std::make_shared<CoatedMetal>(coat, lobe.alpha, recipe.flake.index, recipe.tint));
    uncovered -= lobe.share;
  }
  parts.add(uncovered, std::make_shared<CoatedDiffuse>(coat, recipe.base));
  return parts.mixture();
}

std::shared_ptr<const BrdfModel> model_of(const Pearl& recipe) {
  const Coat coat{recipe.coat.index.n[1]};
  const auto reflectance = [&](double cosine) {
    return film_reflectance(cosine, coat.n, recipe.film, recipe.platelet.index);
  };
  Parts parts;
  parts.add_gloss(recipe.surface, recipe.coat.index, Rgb::Ones());
  // Platelets are clear: what they do not reflect goes on to the base, and passes
  // them once more on its way out.
  const Rgb passes = 1.0 - reflectance(1.0);
  Rgb base_share = Rgb::Ones();
  for (const Gloss& lobe : recipe.platelets) {
    parts.add(lobe.share, std::make_shared<CoatedMetal>(coat, lobe.alpha, reflectance));
    base_share -= lobe.share * (1.0 - passes * passes);
  }
  parts.add(base_share, std::make_shared<CoatedDiffuse>(coat, recipe.base));
  return parts.mixture();
}

std::shared_ptr<const BrdfModel> model_of(const Anodised& recipe) {
  const auto reflectance = [&](double cosine) {
    return film_reflectance(cosine, 1.0, recipe.film, recipe.metal.index);
  };
  Parts parts;
  for (const Gloss& lobe : recipe.gloss) {
    parts.add(lobe.share, std::make_shared<Ggx>(lobe.alpha, reflectance));
  }
  return parts.mixture();
}

std::shared_ptr<const BrdfModel> model_of(const Fitted& recipe) {
  Parts parts;
  parts.add(1.0, std::make_shared<RoughDiffuse>(recipe.diffuse, recipe.sigma));
  parts.add(1.0, std::make_shared<ShiftedGamma>(recipe.lobe));
  return parts.mixture();
}

}  // namespace gonio::brdf::recipes
