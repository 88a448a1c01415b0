#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

namespace gonio::files {

/// Whether something that stands under the wanted name may be replaced.
enum class Overwrite { No, Yes };

/// Throws FileError if an AtomicFile or AtomicFolder for `target` would be refused: the parent
/// folder is missing or not writable, or `target` exists and may not be replaced. For the start of
/// long work, so that hours of it are not lost on a typing mistake.
///
/// A target is replaced only by its own kind: a file never replaces a folder or a device.
void require_creatable(const std::filesystem::path& target, Overwrite overwrite = Overwrite::No);

/// A file that appears under its name only when it is whole.
///
/// The bytes go to a hidden file in the same folder. commit() makes them durable, gives them the
/// name and makes the name durable; without commit() the destructor removes them. A crash can leave
/// the hidden file (".NAME.*.part") behind, never half a file under `target`.
///
/// State    constructed -> write()* -> [prepare() ->] commit() -> nothing more.
/// Threads  One thread per object.
/// Errors   FileError with the path and the system's reason.
class AtomicFile {
 public:
  /// Creates the hidden file. Throws when `target` exists, unless told Overwrite::Yes; a target
  /// that appears later is refused by commit().
  explicit AtomicFile(std::filesystem::path target, Overwrite overwrite = Overwrite::No);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  const std::filesystem::path& target() const noexcept { return target_; }

  /// The hidden file, for libraries that open by name (HDF5, libtiff). They must have closed it
  /// before commit(). Do not mix with write().
  const std::filesystem::path& temporary_path() const noexcept { return temporary_; }

  /// Throws as write() would when the file could not grow to `bytes` now: disk, quota, or a limit
  /// on the size of files. For libraries that do not survive it in the middle of their work. Holds
  /// nothing back; only before anything is written.
  void require_room(std::uintmax_t bytes);

  /// Unbuffered: hand over large pieces.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text);

  /// All of commit() that usually fails, without touching `target`: syncs the bytes and the folder,
  /// asks again whether `target` may be replaced. For several files that belong together: prepare
  /// all, then commit all.
  void prepare();

  /// Syncs the bytes to disk, renames, syncs the folder. When it throws and committed() is true,
  /// the file stands under its name, only a power cut may still lose it.
  void commit();

  /// Whether the file has its name.
  bool committed() const noexcept { return descriptor_ < 0; }

 private:
  void make_durable() const;

  std::filesystem::path target_;
  Overwrite overwrite_;
  std::filesystem::path temporary_;
  int descriptor_ = -1;  // -1 after commit()
};

/// Writes `text` to `target` through an AtomicFile.
void write_text_file(const std::filesystem::path& target, std::string_view text,
                     Overwrite overwrite = Overwrite::No);

}  // namespace gonio::files
