#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gonio/brdf/brdf_table.h"
#include "gonio/brdf/builtin_materials.h"

namespace gonio::cli {

/// A material named on the command line: a file of any format of brdf::read_material(), or
/// "builtin:NAME".
struct NamedMaterial {
  std::string name;    ///< file name without extension, or the built-in name
  std::string source;  ///< as given
  const brdf::BuiltinMaterial* builtin = nullptr;
  std::filesystem::path path;  ///< when not built in
  /// Brought to this scale with the factor of `wish` when loaded; empty: left in its own.
  std::optional<brdf::RadiometricScale> scale;
  double merl_to_si = brdf::kMerlToSi;
};

/// Understands the word. A word that is no file but a built-in name is taken as that. Throws
/// UsageError, suggesting the nearest name.
NamedMaterial named_material(const std::string& word);

brdf::BrdfTable load_table(const NamedMaterial& material);

/// The table in another scale; unchanged when it has that already.
brdf::BrdfTable in_scale(brdf::BrdfTable table, brdf::RadiometricScale to, double merl_to_si);

/// A material as the simulated sample: exact for built-in ones, trilinear for files.
struct SampleMaterial {
  std::shared_ptr<const brdf::BrdfModel> model;
  brdf::RadiometricScale scale = brdf::RadiometricScale::si;
};
SampleMaterial load_sample(const NamedMaterial& material);

/// The names of the built-in materials.
std::vector<std::string> builtin_names();
/// By name. Throws UsageError, suggesting the nearest name.
const brdf::BuiltinMaterial& require_builtin(const std::string& name);

/// What a value is multiplied by to come into the scale `to` from the other one.
double factor_to(brdf::RadiometricScale to, double merl_to_si);

}  // namespace gonio::cli
