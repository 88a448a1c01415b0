#include "provenance.h"

#include <span>

#include "gonio/files/sha256.h"
#include "gonio/version/version.h"

namespace gonio::cli {

nlohmann::ordered_json provenance(const std::string& command) {
  return {{"command", command}, {"version", version()}, {"revision", revision()}};
}

std::string version_text() { return std::string(version()) + " (" + revision() + ")"; }

nlohmann::ordered_json input_record(const std::filesystem::path& path) {
  return {{"name", path.filename().string()}, {"sha256", files::sha256_of_file(path)}};
}

std::string basis_fingerprint(const basis::Basis& basis) {
  files::Sha256 hash;
  for (const basis::MaterialId& material : basis.materials) {
    hash.update(material.name + "\n" + material.sha256 + "\n");
  }
  const std::span singular(basis.singular_values.data(),
                           static_cast<std::size_t>(basis.singular_values.size()));
  hash.update(std::as_bytes(singular));
  return hash.finish();
}

std::map<std::string, std::size_t> source_counts(const basis::Basis& basis) {
  std::map<std::string, std::size_t> counts;
  for (const basis::MaterialId& material : basis.materials) {
    ++counts[material.source.empty() ? "unknown" : material.source];
  }
  return counts;
}

nlohmann::ordered_json basis_record(const basis::Basis& basis) {
  return {{"materials", basis.materials.size()},
          {"sources", source_counts(basis)},
          {"components", basis.component_count()},
          {"fingerprint", basis_fingerprint(basis)}};
}

}  // namespace gonio::cli
