#include "gonio/setup/named_material.h"

#include <fmt/format.h>

#include <algorithm>

#include "gonio/brdf/analytic_models.h"
#include "gonio/brdf/material_file.h"
#include "gonio/console/failures.h"
#include "gonio/console/suggest.h"

namespace gonio::cli {
namespace {

constexpr std::string_view kBuiltinPrefix = "builtin:";

const brdf::BuiltinMaterial* find_builtin(std::string_view name) {
  for (const brdf::BuiltinMaterial& material : brdf::builtin_materials()) {
    if (material.name == name) return &material;
  }
  return nullptr;
}

bool has_material_extension(const std::string& word) {
  const auto extensions = brdf::material_extensions();
  return std::any_of(extensions.begin(), extensions.end(),
                     [&](std::string_view extension) { return word.ends_with(extension); });
}

}  // namespace

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

double factor_to(brdf::RadiometricScale to, double merl_to_si) {
  return to == brdf::RadiometricScale::si ? merl_to_si : 1.0 / merl_to_si;
}

NamedMaterial named_material(const std::string& word) {
  NamedMaterial material;
  material.source = word;
  if (word.starts_with(kBuiltinPrefix)) {
    material.builtin = &require_builtin(word.substr(kBuiltinPrefix.size()));
  } else if (!std::filesystem::exists(word) && word.find('/') == std::string::npos &&
             !has_material_extension(word)) {
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
  brdf::BrdfTable table = material.builtin != nullptr
                              ? brdf::tabulate(*material.builtin->model, brdf::RadiometricScale::si)
                              : brdf::read_material(material.path);
  if (!material.scale) return table;
  return in_scale(std::move(table), *material.scale, material.merl_to_si);
}

brdf::BrdfTable in_scale(brdf::BrdfTable table, brdf::RadiometricScale to, double merl_to_si) {
  if (table.scale() == to) return table;
  return std::move(table).rescaled(factor_to(to, merl_to_si), to);
}

SampleMaterial load_sample(const NamedMaterial& material) {
  if (material.builtin != nullptr) return {material.builtin->model, brdf::RadiometricScale::si};
  const brdf::BrdfTable table = brdf::read_material(material.path);
  return {std::make_shared<brdf::TableBrdf>(table), table.scale()};
}

}  // namespace gonio::cli
