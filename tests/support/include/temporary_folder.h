#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace gonio {

/// All bytes of a file; empty when it cannot be read.
std::string read_bytes(const std::filesystem::path& path);
void write_bytes(const std::filesystem::path& path, std::string_view bytes);

/// A fresh folder, in memory where that is large enough, else under the system's temporary folder;
/// removed with everything in it at the end.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(std::string_view name) const { return path_ / name; }

  /// Names in it, sorted, hidden ones as well.
  std::vector<std::string> names() const;
  /// Returns where it now stands.
  std::filesystem::path write(std::string_view name, std::string_view bytes) const;
  std::string read(std::string_view name) const { return read_bytes(path_ / name); }

 private:
  std::filesystem::path path_;
};

}  // namespace gonio
