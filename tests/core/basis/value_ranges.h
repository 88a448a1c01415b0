#pragma once

#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

namespace gonio::basis::test {

/// First byte and the one behind the last of each data set's values, ascending: all other bytes of
/// an HDF5 file are the library's own. For whole files with contiguous data sets in the root.
std::vector<std::pair<std::uint64_t, std::uint64_t>> value_ranges(
    const std::filesystem::path& path);

}  // namespace gonio::basis::test
