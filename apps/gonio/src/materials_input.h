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
#include "gonio/setup/named_material.h"

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

/// Warns when the file's values are clearly more reciprocal read under another convention; with
/// `always` says how reciprocal they are in any case. Nothing for MERL files and built-in ones.
enum class Report { warnings, always };
void report_conventions(const Console& console, const NamedMaterial& material, Report what);

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
