#pragma once

#include <filesystem>

namespace gonio::emulate {

/// Removes a folder should this program die, also by SIGKILL: a process of its own waits for that.
/// What ends well has removed the folder itself.
///
/// Lifetime  From before the program has threads until after the folder is gone. A process that is
///           forked meanwhile and does not exec keeps the guard waiting.
class FolderGuard {
 public:
  /// Throws std::system_error.
  FolderGuard();
  ~FolderGuard();
  FolderGuard(const FolderGuard&) = delete;
  FolderGuard& operator=(const FolderGuard&) = delete;

  /// Once; the folder must be ours and exist. Throws std::system_error when the guard cannot be
  /// told.
  void watch(const std::filesystem::path& folder) const;

 private:
  int pipe_ = -1;
};

}  // namespace gonio::emulate
