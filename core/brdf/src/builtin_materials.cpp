#include "gonio/brdf/builtin_materials.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "material_recipes.h"

namespace gonio::brdf {
namespace {

std::vector<BuiltinMaterial> all_families() {
  std::vector<BuiltinMaterial> list;
  recipes::add_paints(list);
  recipes::add_plastics(list);
  recipes::add_metals(list);
  recipes::add_fabrics(list);
  recipes::add_woods(list);
  recipes::add_metallic_paints(list);
  recipes::add_rubbers(list);
  recipes::add_ceramics(list);
  recipes::add_phenolics(list);
  recipes::add_papers(list);
  return list;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
    }
  }
  return row.back();
}

}  // namespace

const std::vector<BuiltinMaterial>& builtin_materials() {
  static const std::vector<BuiltinMaterial> materials = all_families();
  return materials;
}

std::vector<std::string> families() {
  std::vector<std::string> names;
  for (const BuiltinMaterial& material : builtin_materials()) {
    if (names.empty() || names.back() != material.family) {
      names.push_back(material.family);
    }
  }
  return names;
}

const BuiltinMaterial& builtin_material(std::string_view name) {
  const std::vector<BuiltinMaterial>& all = builtin_materials();
  const auto found = std::find_if(all.begin(), all.end(),
                                  [&](const BuiltinMaterial& m) { return m.name == name; });
  if (found != all.end()) return *found;
  const auto nearest = std::min_element(
      all.begin(), all.end(), [&](const BuiltinMaterial& a, const BuiltinMaterial& b) {
        return edit_distance(a.name, name) < edit_distance(b.name, name);
      });
  throw std::invalid_argument("no built-in material \"" + std::string(name) + "\"; nearest is \"" +
                              nearest->name + "\"");
}

}  // namespace gonio::brdf
