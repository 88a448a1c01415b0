#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

namespace gonio::brdf {

/// A file of known size that is read from front to back.
///
/// Errors   DataFormatError when it is a folder, pipe, device or socket (opening one never blocks);
///          FileError when the system refuses.
class RegularFile {
 public:
  explicit RegularFile(const std::filesystem::path& path);
  ~RegularFile();
  RegularFile(RegularFile&& other) noexcept;
  RegularFile& operator=(RegularFile&&) = delete;

  /// Nothing when `path` does not exist.
  static std::optional<RegularFile> open_if_exists(const std::filesystem::path& path);

  /// Bytes when it was opened.
  std::uintmax_t size() const { return size_; }

  /// Fills `bytes`; DataFormatError with the offset when the file ends before.
  void read(std::span<std::byte> bytes);

 private:
  RegularFile(const std::filesystem::path& path, int descriptor);

  std::filesystem::path path_;
  int descriptor_;
  std::uintmax_t size_ = 0;
  std::uintmax_t offset_ = 0;
};

}  // namespace gonio::brdf
