#include "temporary_folder.h"

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace gonio {

std::string read_bytes(const std::filesystem::path& path) {
  std::ostringstream bytes;
  bytes << std::ifstream(path, std::ios::binary).rdbuf();
  return bytes.str();
}

void write_bytes(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

namespace {

/// In memory where there is room: thousands of sessions that sync every frame take minutes on a
/// disk that others use, and prove nothing more there. TMPDIR and GONIO_TEST_FOLDERS_ON_DISK go
/// before it.
std::filesystem::path parent_of_folders() {
  constexpr std::uintmax_t kEnough = std::uintmax_t{2} << 30;
  const std::filesystem::path memory = "/dev/shm";
  std::error_code none;
  const std::filesystem::space_info space = std::filesystem::space(memory, none);
  const bool usable = !none && space.available >= kEnough && access(memory.c_str(), W_OK) == 0;
  const bool elsewhere =
      std::getenv("TMPDIR") != nullptr || std::getenv("GONIO_TEST_FOLDERS_ON_DISK") != nullptr;
  return usable && !elsewhere ? memory : std::filesystem::temp_directory_path();
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  // mkdtemp() replaces the six letters.
  const std::string name = "gonio-test-" + std::string(6, 'X');
  std::string pattern = (parent_of_folders() / name).string();
  if (mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("cannot make " + pattern);
  path_ = pattern;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::vector<std::string> TemporaryFolder::names() const {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(path_)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::filesystem::path TemporaryFolder::write(std::string_view name, std::string_view bytes) const {
  write_bytes(path_ / name, bytes);
  return path_ / name;
}

}  // namespace gonio
