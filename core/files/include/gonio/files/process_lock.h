#pragma once

#include <sys/types.h>

#include <filesystem>
#include <optional>

#include "gonio/errors/errors.h"

namespace gonio::files {

/// What a lock was asked for is locked already, by a process that lives.
class HeldByAnother : public FileError {
 public:
  HeldByAnother(const std::filesystem::path& path, pid_t holder, const std::string& reason)
      : FileError(path, "lock", reason), holder_(holder) {}
  pid_t holder() const noexcept { return holder_; }  ///< 0: it did not say

 private:
  pid_t holder_;
};

/// A file that one process at a time holds, and that tells who: it contains the process's number.
///
/// State    Held from construction until the object or its process ends, in whatever way; the file
///          stays. Nothing that this process starts inherits it, unless it is given the descriptor.
/// Threads  One.
/// Source   flock(2).
class ProcessLock {
 public:
  /// Creates the file if need be, for everybody to use. Throws HeldByAnother, also when this
  /// process holds it already; FileError.
  explicit ProcessLock(const std::filesystem::path& path);
  ~ProcessLock();
  ProcessLock(ProcessLock&& other) noexcept;
  ProcessLock& operator=(ProcessLock&&) = delete;

  /// For a process that is started to hold it as well, beyond the end of this one.
  int descriptor() const { return descriptor_; }

 private:
  int descriptor_ = -1;
};

/// Who holds it: nobody when there is no such file, or it is free; 0 when that is not told.
std::optional<pid_t> lock_holder(const std::filesystem::path& path);

/// Whether `path` still names the file that is open as `descriptor`: not after it, or a folder above
/// it, was moved, replaced or deleted.
bool names_open_file(const std::filesystem::path& path, int descriptor);

/// Makes the names in a folder survive a power cut. Throws FileError.
void sync_folder(const std::filesystem::path& folder);

}  // namespace gonio::files
