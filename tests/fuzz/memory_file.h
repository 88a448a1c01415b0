#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>

namespace gonio::fuzz {

/// The bytes of one trial as a file with a path, in memory: what readers open.
class MemoryFile {
 public:
  explicit MemoryFile(std::span<const std::uint8_t> bytes);
  ~MemoryFile();
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  const std::filesystem::path& path() const { return path_; }

  /// Writes over what is there, growing the file where it has to.
  void write_at(std::uint64_t offset, std::span<const std::uint8_t> bytes);
  void resize(std::uint64_t size);

 private:
  int descriptor_;
  std::filesystem::path path_;
};

}  // namespace gonio::fuzz
