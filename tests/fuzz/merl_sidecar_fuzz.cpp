#include <filesystem>

#include "gonio/brdf/merl_file.h"
#include "temporary_folder.h"
#include "trial.h"

/// The sidecar is found by its name beside the binary: a link to the bytes in memory has it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const gonio::TemporaryFolder folder;
  const int result = gonio::fuzz::trial(data, size, [](const auto& path) {
    std::filesystem::remove(folder / "x.json");
    std::filesystem::create_symlink(path, folder / "x.json");
    const auto sidecar = gonio::brdf::read_merl_sidecar(folder / "x.binary");
  });
  std::filesystem::remove(folder / "x.json");
  return result;
}
