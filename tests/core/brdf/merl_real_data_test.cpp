#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

#include "gonio/brdf/merl_file.h"
#include "temporary_folder.h"

namespace gonio::brdf {
namespace {

namespace fs = std::filesystem;

/// The alphabetically first MERL file of the folder GONIO_REAL_DATA, or of its subfolder merl.
fs::path some_merl_file() {
  const char* root = std::getenv("GONIO_REAL_DATA");
  if (root == nullptr) return {};
  fs::path first;
  for (const fs::path& folder : {fs::path(root) / "merl", fs::path(root)}) {
    std::error_code missing;
    for (const auto& entry : fs::directory_iterator(folder, missing)) {
      if (entry.path().extension() != ".binary") continue;
      if (first.empty() || entry.path() < first) first = entry.path();
    }
    if (!first.empty()) break;
  }
  return first;
}

TEST(MerlRealData, ReadAndWrittenUnchangedIsByteIdentical) {
  const fs::path original = some_merl_file();
  if (original.empty()) GTEST_SKIP() << "GONIO_REAL_DATA names no folder with MERL .binary files";
  const TemporaryFolder folder;
  const BrdfTable table = read_merl(original);
  write_merl(folder / "copy.binary", table);
  EXPECT_TRUE(read_bytes(folder / "copy.binary") == read_bytes(original)) << original;
}

TEST(MerlRealData, IsValidWhereItIsAboveTheHorizon) {
  const fs::path original = some_merl_file();
  if (original.empty()) GTEST_SKIP() << "GONIO_REAL_DATA names no folder with MERL .binary files";
  const BrdfTable table = read_merl(original);
  std::size_t valid = 0;
  for (const std::uint32_t cell : lattice::cells_above_horizon()) valid += table.valid(cell);
  // Measured files leave out a few cells above the horizon, never a tenth of them.
  EXPECT_GT(valid, lattice::cells_above_horizon().size() * 9 / 10) << original;
}

}  // namespace
}  // namespace gonio::brdf
