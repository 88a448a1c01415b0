#include "materials_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "failures.h"
#include "gonio/brdf/merl_file.h"
#include "suggest.h"

namespace gonio::cli {
namespace {

constexpr std::string_view kBuiltin = "builtin";
constexpr std::string_view kBuiltinPrefix = "builtin:";
constexpr std::string_view kFamilyPrefix = "family:";

const brdf::BuiltinMaterial* find_builtin(std::string_view name) {
  for (const brdf::BuiltinMaterial& material : brdf::builtin_materials()) {
    if (material.name == name) return &material;
  }
  return nullptr;
}

std::vector<std::string> builtin_names() {
  std::vector<std::string> names;
  for (const brdf::BuiltinMaterial& material : brdf::builtin_materials()) {
    names.push_back(material.name);
  }
  return names;
}

const brdf::BuiltinMaterial& require_builtin(const std::string& name) {
  const brdf::BuiltinMaterial* found = find_builtin(name);
  if (found != nullptr) return *found;
  throw UsageError(
      fmt::format("no built-in material \"{}\"{}", name, did_you_mean(name, builtin_names())),
      "`gonio materials list` shows all");
}

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() == ".binary") files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  if (files.empty()) {
    throw UsageError(folder.string() + ": found no *.binary file, expected MERL materials");
  }
  return files;
}

void exclude(TrainingInput& input, const std::string& word) {
  const std::size_t before = input.size();
  if (word.starts_with(kFamilyPrefix)) {
    const std::string family = word.substr(kFamilyPrefix.size());
    std::erase_if(input.builtins, [&](const auto* each) { return each->family == family; });
  } else {
    std::erase_if(input.builtins, [&](const auto* each) { return each->name == word; });
    std::erase_if(input.files, [&](const auto& each) { return each.path.stem() == word; });
  }
  if (input.size() != before) return;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < input.size(); ++i) names.push_back(input.name(i));
  throw UsageError(fmt::format("--exclude {}: no such material among the {} given{}", word,
                               input.size(), did_you_mean(word, names)));
}

}  // namespace

NamedMaterial named_material(const std::string& word) {
  NamedMaterial material;
  material.source = word;
  if (word.starts_with(kBuiltinPrefix)) {
    material.builtin = &require_builtin(word.substr(kBuiltinPrefix.size()));
  } else if (!std::filesystem::exists(word) && word.find('/') == std::string::npos &&
             !word.ends_with(".binary")) {
    material.builtin = find_builtin(word);
    if (material.builtin == nullptr) {
      throw UsageError(fmt::format("{}: found neither a file nor a built-in material{}", word,
                                   did_you_mean(word, builtin_names())));
    }
  }
  if (material.builtin != nullptr) {
    material.name = material.builtin->name;
  } else {
    material.path = word;
    material.name = material.path.stem().string();
  }
  return material;
}

brdf::BrdfTable load_table(const NamedMaterial& material) {
  if (material.builtin == nullptr) return brdf::read_merl(material.path);
  return brdf::tabulate(*material.builtin->model, brdf::RadiometricScale::si);
}

SampleMaterial load_sample(const NamedMaterial& material) {
  if (material.builtin != nullptr) return {material.builtin->model, brdf::RadiometricScale::si};
  const brdf::BrdfTable table = brdf::read_merl(material.path);
  return {std::make_shared<brdf::TableBrdf>(table), table.scale()};
}

std::string TrainingInput::name(std::size_t i) const {
  if (i < builtins.size()) return builtins[i]->name;
  return files[i - builtins.size()].path.stem().string();
}

NamedMaterial TrainingInput::material(std::size_t i) const {
  if (i < builtins.size()) {
    const std::string& name = builtins[i]->name;
    return {name, std::string(kBuiltinPrefix) + name, builtins[i], {}};
  }
  const std::filesystem::path& path = files[i - builtins.size()].path;
  return {path.stem().string(), path.string(), nullptr, path};
}

TrainingInput training_input(const std::vector<std::string>& words,
                             const std::vector<std::string>& excluded) {
  TrainingInput input;
  for (const std::string& word : words) {
    if (word == kBuiltin) {
      for (const auto& material : brdf::builtin_materials()) input.builtins.push_back(&material);
    } else if (word.starts_with(kBuiltinPrefix)) {
      input.builtins.push_back(&require_builtin(word.substr(kBuiltinPrefix.size())));
    } else if (std::filesystem::is_directory(word)) {
      for (auto& path : files_in(word)) input.files.push_back({std::move(path), ""});
    } else if (std::filesystem::path(word).extension() == ".bsdf") {
      throw UsageError(word + ": found a .bsdf file, expected a MERL .binary file");
    } else {
      input.files.push_back({word, ""});
    }
  }
  if (!input.builtins.empty() && !input.files.empty()) {
    throw UsageError(
        "built-in materials are in SI units and MERL files usually are not: give one kind only");
  }
  for (const std::string& word : excluded) exclude(input, word);
  std::set<std::string> names;
  for (std::size_t i = 0; i < input.size(); ++i) {
    if (!names.insert(input.name(i)).second) {
      throw UsageError(fmt::format("material \"{}\" is given twice", input.name(i)));
    }
  }
  return input;
}

basis::TrainingSet load_training_set(const TrainingInput& input) {
  if (!input.builtins.empty()) {
    basis::TrainingSet set(brdf::RadiometricScale::si);
    for (const brdf::BuiltinMaterial* material : input.builtins) {
      set.add({material->name, material->family, ""}, *material->model);
    }
    return set;
  }
  // The first file says which scale all must have; its contents are checked by add_files().
  brdf::RadiometricScale scale = brdf::RadiometricScale::merl;
  if (!input.files.empty()) {
    if (const auto sidecar = brdf::read_merl_sidecar(input.files.front().path)) {
      scale = sidecar->scale;
    }
  }
  basis::TrainingSet set(scale);
  set.add_files(input.files);
  return set;
}

}  // namespace gonio::cli
