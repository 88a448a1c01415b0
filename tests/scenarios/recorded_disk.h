#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gonio {

/// Every write, sync, rename and removal by which a session archive comes to be, in order: of
/// SQLite through a VFS under it (database, log and all), of frame files through the system calls
/// of gonio::files (wrapped by the linker: tests/scenarios/CMakeLists.txt). From it a disk can be
/// made as it would be had everything ended at any of these moments.
///
/// Model    A file holds what it was last synced with; names hold once their folder was synced
///          after, as POSIX grants no more. SQLite syncs the folder with the first sync of a log it
///          has created (os_unix.c, UNIXFILE_DIRSYNC).
/// Threads  One; one object at a time in a program.
class RecordedDisk {
 public:
  /// Records what happens in `folder` while the object lives. It need not exist yet; what it holds
  /// counts as synced.
  explicit RecordedDisk(std::filesystem::path folder);
  ~RecordedDisk();
  RecordedDisk(const RecordedDisk&) = delete;
  RecordedDisk& operator=(const RecordedDisk&) = delete;

  /// So many so far.
  std::size_t count() const { return operations_.size(); }

  /// Operation number `from` and all later ones fail with this errno, until the object ends.
  void fail_from(std::size_t from, int error);

  enum class Loss {
    nothing,    ///< the process was killed
    unsynced,   ///< the power was cut: what was not synced is gone
    at_random,  ///< the power was cut: of what was not synced any part may have come through
    half_write  ///< killed in the middle of a write
  };
  /// Makes `to` as the folder was after the first `count` operations and the loss.
  void restore(std::size_t count, Loss loss, std::uint64_t seed,
               const std::filesystem::path& to) const;

  // For the hooks.
  enum class Kind { create, write, truncate, sync, rename, remove, sync_folder };
  struct Operation {
    Kind kind;
    std::string path;  ///< relative to the folder
    std::int64_t at = 0;
    std::string bytes;  ///< written; of a rename the new name
  };
  /// False when it has to fail; errno then says with what.
  bool take(Operation operation);
  /// Relative to the folder; empty when it is not in it.
  std::string inside(const std::string& path) const;

 private:
  std::filesystem::path folder_;
  std::vector<Operation> found_;  ///< from which nothing comes to what was there before
  std::vector<Operation> operations_;
  std::size_t fails_from_ = SIZE_MAX;
  int error_ = 0;
};

}  // namespace gonio
