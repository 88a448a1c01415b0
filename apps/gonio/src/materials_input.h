#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "gonio/basis/training_set.h"
#include "gonio/brdf/brdf_table.h"
#include "gonio/brdf/builtin_materials.h"

namespace gonio::cli {

/// A material named on the command line: a MERL file, or "builtin:NAME".
struct NamedMaterial {
  std::string name;    ///< file name without extension, or the built-in name
  std::string source;  ///< as given
  const brdf::BuiltinMaterial* builtin = nullptr;
  std::filesystem::path path;  ///< when not built in
};

/// Understands the word. A word that is no file but a built-in name is taken as that. Throws
/// UsageError, suggesting the nearest name.
NamedMaterial named_material(const std::string& word);

brdf::BrdfTable load_table(const NamedMaterial& material);

/// A material as the simulated sample: exact for built-in ones, trilinear for files.
struct SampleMaterial {
  std::shared_ptr<const brdf::BrdfModel> model;
  brdf::RadiometricScale scale = brdf::RadiometricScale::si;
};
SampleMaterial load_sample(const NamedMaterial& material);

/// Materials to train on or to evaluate: built-in ones or MERL files, never both (their scales
/// differ).
struct TrainingInput {
  std::vector<const brdf::BuiltinMaterial*> builtins;
  std::vector<basis::MaterialFile> files;

  std::size_t size() const { return builtins.size() + files.size(); }
  std::string name(std::size_t i) const;
  NamedMaterial material(std::size_t i) const;
};

/// Files, folders (their *.binary files by name), "builtin" or "builtin:NAME"; without those of
/// `excluded`: names, or "family:NAME" for built-in ones. Throws UsageError: nothing found, a name
/// twice, an exclusion that matches nothing.
TrainingInput training_input(const std::vector<std::string>& words,
                             const std::vector<std::string>& excluded);

basis::TrainingSet load_training_set(const TrainingInput& input);

}  // namespace gonio::cli
