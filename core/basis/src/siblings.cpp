#include "gonio/basis/siblings.h"

#include <algorithm>
#include <map>
#include <string>

namespace gonio::basis {

std::vector<std::size_t> sibling_groups(std::span<const MaterialId> materials) {
  std::map<std::string, std::size_t> number_of;
  std::vector<std::size_t> groups;
  std::size_t count = 0;
  for (const MaterialId& id : materials) {
    const std::size_t number =
        id.group.empty() ? count : number_of.try_emplace(id.group, count).first->second;
    if (number == count) ++count;
    groups.push_back(number);
  }
  return groups;
}

std::size_t count_groups(std::span<const MaterialId> materials) {
  const std::vector<std::size_t> groups = sibling_groups(materials);
  return groups.empty() ? 0 : *std::max_element(groups.begin(), groups.end()) + 1;
}

std::vector<std::vector<Eigen::Index>> rows_of_groups(const Basis& basis) {
  std::vector<std::vector<Eigen::Index>> rows;
  const std::vector<std::size_t> group = sibling_groups(basis.materials);
  for (std::size_t material = 0; material < group.size(); ++material) {
    if (group[material] >= rows.size()) rows.emplace_back();
    for (int channel = 0; channel < 3; ++channel) {
      rows[group[material]].push_back(static_cast<Eigen::Index>(3 * material) + channel);
    }
  }
  return rows;
}

}  // namespace gonio::basis
