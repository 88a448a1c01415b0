#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

namespace gonio::files {

/// A regular file of known size: what every reader of a user's file opens first.
///
/// Hostile  A folder, pipe, socket or device is refused at once: opening one never blocks, and
///          nothing is ever read from one.
/// Threads  One thread per object.
/// Errors   FileError with the path when it is no regular file or the system refuses.
class InputFile {
 public:
  explicit InputFile(const std::filesystem::path& path);
  ~InputFile();
  InputFile(InputFile&& other) noexcept;
  InputFile& operator=(InputFile&&) = delete;

  /// Nothing when `path` does not exist.
  static std::optional<InputFile> open_if_exists(const std::filesystem::path& path);

  /// Bytes when it was opened.
  std::uintmax_t size() const { return size_; }

  /// Fills `bytes` from where the last read ended; DataFormatError with the offset when the file
  /// ends before.
  void read(std::span<std::byte> bytes);

  /// The same from anywhere; the next read goes on behind it.
  void read_at(std::uintmax_t offset, std::span<std::byte> bytes);

  /// Reads what is there, at most `bytes.size()`; 0 at the end only.
  std::size_t read_some(std::span<std::byte> bytes);

 private:
  InputFile(const std::filesystem::path& path, int descriptor);

  std::filesystem::path path_;
  int descriptor_;
  std::uintmax_t size_ = 0;
  std::uintmax_t offset_ = 0;
};

/// Throws FileError as InputFile does. For files that a library opens by name (HDF5, libtiff,
/// SQLite) and that nobody exchanges in between.
void require_regular_file(const std::filesystem::path& path);

}  // namespace gonio::files
