#include "materials_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "command.h"
#include "gonio/brdf/analytic_models.h"
#include "gonio/brdf/material_file.h"
#include "gonio/console/failures.h"
#include "gonio/console/suggest.h"

namespace gonio::cli {
namespace {

constexpr std::string_view kBuiltin = "builtin";
constexpr std::string_view kBuiltinPrefix = "builtin:";
constexpr std::string_view kFamilyPrefix = "family:";

std::vector<std::filesystem::path> files_in(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  const auto extensions = brdf::material_extensions();
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (std::find(extensions.begin(), extensions.end(), extension) != extensions.end()) {
      files.push_back(entry.path());
    }
  }
  std::sort(files.begin(), files.end());
  if (files.empty()) {
    throw UsageError(fmt::format("{}: found no material, expected files *{}", folder.string(),
                                 fmt::join(extensions, ", *")));
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

brdf::RadiometricScale scale_of(const TrainingInput& input, std::size_t i) {
  if (i < input.builtins.size()) return brdf::RadiometricScale::si;
  return brdf::material_scale(input.files[i - input.builtins.size()].path);
}

/// Settles the scale of all and the factor of every file.
void bring_to_one_scale(TrainingInput& input, const ScaleWish& wish) {
  input.merl_to_si = wish.merl_to_si;
  if (!wish.scale.empty()) {
    input.scale = brdf::radiometric_scale_from_string(wish.scale);
    for (basis::MaterialFile& file : input.files) {
      file.scale_factor = factor_to(input.scale, wish.merl_to_si);
    }
    return;
  }
  if (input.size() == 0) return;
  input.scale = scale_of(input, 0);
  for (std::size_t i = 1; i < input.size(); ++i) {
    if (scale_of(input, i) == input.scale) continue;
    throw UsageError(fmt::format("{} is in scale {}, {} in scale {}, expected one for all",
                                 input.name(0), brdf::to_string(input.scale), input.name(i),
                                 brdf::to_string(scale_of(input, i))),
                     "--scale si or --scale merl brings all to one, by the factor of --merl-to-si");
  }
}

}  // namespace

void add_scale_options(const Command& command, ScaleWish& wish) {
  command.choice("--scale", wish.scale, {"si", "merl"},
                 "Bring all materials to this radiometric scale (default: they must share one)");
  command.number("--merl-to-si", wish.merl_to_si, 1e-3, 1e3,
                 "What a value in MERL scale is multiplied by to be in SI");
}

void report_conventions(const Console& console, const NamedMaterial& material, Report what) {
  if (material.builtin != nullptr) return;
  const auto report = brdf::check_file_conventions(material.path);
  if (!report) return;
  if (what == Report::always) console.say(material.source + ": " + report->text());
  if (const std::string warning = report->warning(); !warning.empty()) {
    console.warn(material.source + ": " + warning);
  }
}

std::string TrainingInput::name(std::size_t i) const {
  if (i < builtins.size()) return builtins[i]->name;
  return files[i - builtins.size()].path.stem().string();
}

NamedMaterial TrainingInput::material(std::size_t i) const {
  if (i < builtins.size()) {
    const std::string& name = builtins[i]->name;
    return {name, std::string(kBuiltinPrefix) + name, builtins[i], {}, scale, merl_to_si};
  }
  const std::filesystem::path& path = files[i - builtins.size()].path;
  return {path.stem().string(), path.string(), nullptr, path, scale, merl_to_si};
}

TrainingInput training_input(const std::vector<std::string>& words,
                             const std::vector<std::string>& excluded, const ScaleWish& wish) {
  TrainingInput input;
  for (const std::string& word : words) {
    if (word == kBuiltin) {
      for (const auto& material : brdf::builtin_materials()) input.builtins.push_back(&material);
    } else if (word.starts_with(kBuiltinPrefix)) {
      input.builtins.push_back(&require_builtin(word.substr(kBuiltinPrefix.size())));
    } else if (std::filesystem::is_directory(word)) {
      for (auto& path : files_in(word)) input.files.push_back({std::move(path), ""});
    } else {
      input.files.push_back({word, ""});
    }
  }
  for (const std::string& word : excluded) exclude(input, word);
  std::set<std::string> names;
  for (std::size_t i = 0; i < input.size(); ++i) {
    if (!names.insert(input.name(i)).second) {
      throw UsageError(fmt::format("material \"{}\" is given twice", input.name(i)));
    }
  }
  bring_to_one_scale(input, wish);
  return input;
}

basis::TrainingSet load_training_set(const TrainingInput& input,
                                     const std::function<void(double)>& on_progress) {
  const auto report = [&](std::size_t done) {
    on_progress(static_cast<double>(done) / static_cast<double>(input.size()));
  };
  const auto group_of = [&](const std::string& name) {
    const auto found = input.groups.find(name);
    return found == input.groups.end() ? std::string() : found->second;
  };
  basis::TrainingSet set(input.scale);
  for (const brdf::BuiltinMaterial* material : input.builtins) {
    report(set.material_count());
    basis::MaterialId id{material->name, material->family, ""};
    id.group = group_of(material->name);
    id.source = kBuiltin;
    if (input.scale == brdf::RadiometricScale::si) {
      set.add(std::move(id), *material->model);
      continue;
    }
    id.scale_factor = factor_to(input.scale, input.merl_to_si);
    set.add(std::move(id),
            brdf::Mixture({{brdf::Rgb::Constant(id.scale_factor), material->model}}));
  }
  std::vector<basis::MaterialFile> files = input.files;
  for (basis::MaterialFile& file : files) file.group = group_of(file.path.stem().string());
  set.add_files(files, [&](std::size_t done) { report(input.builtins.size() + done); });
  return set;
}

}  // namespace gonio::cli
