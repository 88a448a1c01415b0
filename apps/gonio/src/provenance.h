#pragma once

#include <cstddef>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "gonio/basis/basis.h"

namespace gonio::cli {

/// What every output says about its making. Nothing of the host and no time of day, so that the
/// same work gives the same bytes.
nlohmann::ordered_json provenance(const std::string& command);

/// "0.1.0 (revision)".
std::string version_text();

/// Name and SHA-256 of an input file.
nlohmann::ordered_json input_record(const std::filesystem::path& path);

/// How many materials of a basis come from each database; "unknown" where it does not say.
std::map<std::string, std::size_t> source_counts(const basis::Basis& basis);

/// A basis in a few words: materials, their sources, components and a hash of them.
nlohmann::ordered_json basis_record(const basis::Basis& basis);

/// Hash of names, values' hashes and spectrum: equal for equal training.
std::string basis_fingerprint(const basis::Basis& basis);

}  // namespace gonio::cli
