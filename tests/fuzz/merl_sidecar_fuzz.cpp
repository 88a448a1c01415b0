#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <string>

#include "gonio/brdf/merl_file.h"
#include "trial.h"

/// The sidecar is found by its name beside the binary: a link to the bytes in memory has it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::filesystem::path folder = [] {
    std::string name = (std::filesystem::temp_directory_path() / "gonio_fuzz_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) std::abort();
    return std::filesystem::path(name);
  }();
  const int result = gonio::fuzz::trial(data, size, [](const auto& path) {
    std::filesystem::remove(folder / "x.json");
    std::filesystem::create_symlink(path, folder / "x.json");
    const auto sidecar = gonio::brdf::read_merl_sidecar(folder / "x.binary");
  });
  std::filesystem::remove(folder / "x.json");
  return result;
}
