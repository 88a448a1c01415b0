#pragma once

#include <memory>
#include <string>
#include <vector>

#include "gonio/brdf/builtin_materials.h"
#include "gonio/brdf/microfacet_models.h"
#include "optical_constants.h"

/// How the built-in materials are put together. A recipe is data; model_of() makes the model. The
/// shares of a surface's lobes sum to at most 1, which keeps its energy.
namespace gonio::brdf::recipes {

using optical_constants::Published;

/// A share of the surface that reflects as a GGX lobe.
struct Gloss {
  double share;
  double alpha;
};

/// A share of the surface that reflects as an ABC lobe: haze with a long tail.
struct Haze {
  double share = 0.0;
  double b = 1.0;
  double c = 1.0;
};

/// Pigment or fibre under a clear surface: paint, plastic, glaze, varnish, stone.
struct Opaque {
  Published surface;
  Rgb base;                 ///< albedo below the surface
  double sigma = 0.0;       ///< roughness of the base
  Rgb depth = Rgb::Zero();  ///< optical depth of a stained surface layer
  std::vector<Gloss> gloss;
  Haze haze = {};
};
std::shared_ptr<const BrdfModel> model_of(const Opaque& recipe);

/// Bare metal; what is not polished evenly has several lobes.
struct Metal {
  Published metal;
  std::vector<Gloss> gloss;
  Haze haze = {};
  Rgb tint = Rgb::Ones();  ///< tarnish
  Rgb dull = Rgb::Zero();  ///< albedo of oxide and dirt between
};
std::shared_ptr<const BrdfModel> model_of(const Metal& recipe);

/// Woven or felted fibres.
struct Cloth {
  Published fibre;
  Rgb diffuse;
  double sigma = 0.5;
  Rgb volume = Rgb::Zero();  ///< scattered once between the fibres
  double asymmetry = 0.0;
  Rgb sheen = Rgb::Zero();
  double sheen_roughness = 0.3;
  Rgb backscatter = Rgb::Zero();
  double backscatter_width = 0.2;
  std::vector<Gloss> gloss = {};
  Rgb gloss_tint = Rgb::Ones();  ///< dyed fibres colour what passes through them
};
std::shared_ptr<const BrdfModel> model_of(const Cloth& recipe);

/// Flakes in a binder under a clear coat; between them the base shows.
struct Flakes {
  Published coat;
  std::vector<Gloss> surface;
  Published flake;
  std::vector<Gloss> flakes;  ///< inside the coat
  Rgb tint = Rgb::Ones();
  Rgb base = Rgb::Zero();
  Rgb depth = Rgb::Zero();  ///< of a candy coat
};
std::shared_ptr<const BrdfModel> model_of(const Flakes& recipe);

/// Platelets with an interference film in a clear coat, over a base. The film's colour turns with
/// the angle between light and detector.
struct Pearl {
  Published coat;
  std::vector<Gloss> surface;
  Film film;
  Published platelet;
  std::vector<Gloss> platelets;
  Rgb base;
};
std::shared_ptr<const BrdfModel> model_of(const Pearl& recipe);

/// Bare metal under a transparent oxide film.
struct Anodised {
  Film film;
  Published metal;
  std::vector<Gloss> gloss;
};
std::shared_ptr<const BrdfModel> model_of(const Anodised& recipe);

/// A shifted-gamma lobe over a diffuse base, as fitted to measured materials.
struct Fitted {
  Rgb diffuse;
  double sigma = 0.0;
  ShiftedGamma::Parameters lobe;
};
std::shared_ptr<const BrdfModel> model_of(const Fitted& recipe);

/// Adds the materials of one family to a list.
class Family {
 public:
  Family(std::string name, std::vector<BuiltinMaterial>& list)
      : name_(std::move(name)), list_(list) {}

  template <typename Recipe>
  void add(std::string material, std::string description, const Published& constants,
           const Recipe& recipe) {
    list_.push_back({std::move(material), name_, std::move(description),
                     constants.source + "; colour and roughness chosen", model_of(recipe)});
  }

 private:
  std::string name_;
  std::vector<BuiltinMaterial>& list_;
};

void add_paints(std::vector<BuiltinMaterial>& list);
void add_plastics(std::vector<BuiltinMaterial>& list);
void add_metals(std::vector<BuiltinMaterial>& list);
void add_fabrics(std::vector<BuiltinMaterial>& list);
void add_woods(std::vector<BuiltinMaterial>& list);
void add_metallic_paints(std::vector<BuiltinMaterial>& list);
void add_rubbers(std::vector<BuiltinMaterial>& list);
void add_ceramics(std::vector<BuiltinMaterial>& list);
void add_phenolics(std::vector<BuiltinMaterial>& list);
void add_papers(std::vector<BuiltinMaterial>& list);

}  // namespace gonio::brdf::recipes
