#include "siblings_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <map>
#include <vector>

#include "command.h"
#include "gonio/console/failures.h"
#include "gonio/samples/csv.h"

namespace gonio::cli {
namespace {

constexpr std::size_t kLongestGroup = 256;  // bytes

}  // namespace

void add_siblings_option(const Command& command, std::string& path) {
  command.text("--siblings", path,
               "CSV file material,group: materials of one group are left out together");
}

void read_siblings(const Console& console, const std::filesystem::path& path, TrainingInput& input,
                   std::vector<basis::MaterialId>* trained) {
  samples::CsvReader reader(path);
  const auto material = reader.column("material");
  const auto group = reader.column("group");
  if (!material || !group) {
    throw UsageError(fmt::format("{}: line {}: expected columns material and group", path.string(),
                                 reader.header_line()));
  }
  std::map<std::string, std::string> group_of;
  while (const auto row = reader.next()) {
    if (row->cells[*group].size() > kLongestGroup) {
      throw UsageError(fmt::format("{}: line {}: a group of {} bytes, at most {} are kept",
                                   path.string(), row->line, row->cells[*group].size(),
                                   kLongestGroup));
    }
    const auto [known, added] = group_of.emplace(row->cells[*material], row->cells[*group]);
    if (added || known->second == row->cells[*group]) continue;
    throw UsageError(fmt::format("{}: line {}: {} stands in two groups, {} and {}", path.string(),
                                 row->line, known->first, known->second, row->cells[*group]));
  }
  std::map<std::string, std::string> unknown = group_of;
  for (std::size_t i = 0; i < input.size(); ++i) {
    const auto found = group_of.find(input.name(i));
    if (found == group_of.end()) continue;
    input.groups[found->first] = found->second;
    unknown.erase(found->first);
  }
  if (trained != nullptr) {
    for (basis::MaterialId& id : *trained) {
      const auto found = group_of.find(id.name);
      if (found == group_of.end()) continue;
      if (!id.group.empty() && id.group != found->second) {
        throw UsageError(fmt::format("{}: {} is of group {}, in the basis of {}", path.string(),
                                     id.name, found->second, id.group));
      }
      id.group = found->second;
      unknown.erase(id.name);
    }
  }
  if (unknown.size() == group_of.size()) {
    throw UsageError(
        fmt::format("{}: names none of the {} materials given", path.string(), input.size()));
  }
  if (unknown.empty()) return;
  std::vector<std::string> names;
  for (const auto& listed : unknown) names.push_back(listed.first);
  console.warn(
      fmt::format("{}: not among the materials given: {}", path.string(), fmt::join(names, ", ")));
}

}  // namespace gonio::cli
