#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gonio/basis/training_set.h"
#include "gonio/brdf/brdf_table.h"
#include "gonio/brdf/builtin_materials.h"

namespace gonio::cli {

class Command;
class Console;

/// How files of different radiometric scale are brought together. Without a wish all must have the
/// same.
struct ScaleWish {
  std::string scale;                    ///< "si", "merl", or empty: that of the files
  double merl_to_si = brdf::kMerlToSi;  ///< what a MERL value is multiplied by to be SI
};

/// --scale and --merl-to-si
void add_scale_options(const Command& command, ScaleWish& wish);

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

/// Warns when the file's values are clearly more reciprocal read under another convention; with
/// `always` says how reciprocal they are in any case. Nothing for MERL files and built-in ones.
enum class Report { warnings, always };
void report_conventions(const Console& console, const NamedMaterial& material, Report what);

/// A material as the simulated sample: exact for built-in ones, trilinear for files.
struct SampleMaterial {
  std::shared_ptr<const brdf::BrdfModel> model;
  brdf::RadiometricScale scale = brdf::RadiometricScale::si;
};
SampleMaterial load_sample(const NamedMaterial& material);

/// Materials to train on or to evaluate, brought to one scale.
struct TrainingInput {
  brdf::RadiometricScale scale = brdf::RadiometricScale::si;
  double merl_to_si = brdf::kMerlToSi;
  std::vector<const brdf::BuiltinMaterial*> builtins;
  std::vector<basis::MaterialFile> files;
  std::map<std::string, std::string> groups;  ///< of siblings, by the material's name

  std::size_t size() const { return builtins.size() + files.size(); }
  std::string name(std::size_t i) const;
  NamedMaterial material(std::size_t i) const;
};

/// Files, folders (the material files in them by name), "builtin" or "builtin:NAME"; without those
/// of `excluded`: names, or "family:NAME" for built-in ones. Throws UsageError: nothing found, a
/// name twice, an exclusion that matches nothing, scales that differ without a wish.
TrainingInput training_input(const std::vector<std::string>& words,
                             const std::vector<std::string>& excluded, const ScaleWish& wish);

/// `on_progress`  Called on this thread with the fraction read so far; what it throws ends the
/// work.
basis::TrainingSet load_training_set(const TrainingInput& input,
                                     const std::function<void(double)>& on_progress);

}  // namespace gonio::cli
