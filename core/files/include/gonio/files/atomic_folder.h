#pragma once

#include <filesystem>

#include "gonio/files/atomic_file.h"

namespace gonio::files {

/// A folder that appears under its name only when it is whole: AtomicFile's promise for a tree.
///
/// State    constructed -> files are put below path() -> commit() -> nothing more.
/// Threads  One thread per object; any number may write below path().
/// Errors   FileError with the path and the system's reason.
class AtomicFolder {
 public:
  /// Creates a hidden folder beside `target`. Throws when `target` exists, unless told
  /// Overwrite::Yes; a target that appears later is refused by commit().
  explicit AtomicFolder(const std::filesystem::path& target, Overwrite overwrite = Overwrite::No);

  /// Removes the hidden folder with everything in it when it was not committed.
  ~AtomicFolder();
  AtomicFolder(const AtomicFolder&) = delete;
  AtomicFolder& operator=(const AtomicFolder&) = delete;

  const std::filesystem::path& target() const noexcept { return target_; }

  /// Where to write. Paths below it change with commit(): store them relative.
  const std::filesystem::path& path() const noexcept { return temporary_; }

  /// Syncs every file and folder, renames, syncs the parent. With Overwrite::Yes the old folder
  /// changes places with the new one in one step and is then removed.
  void commit();

 private:
  std::filesystem::path target_;
  Overwrite overwrite_;
  std::filesystem::path temporary_;
  bool committed_ = false;
};

}  // namespace gonio::files
