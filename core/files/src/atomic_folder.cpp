#include "gonio/files/atomic_folder.h"

#include <cerrno>
#include <stdexcept>
#include <system_error>

#include "gonio/errors/errors.h"
#include "posix.h"

namespace gonio::files {
namespace {

/// "results/" names the folder "results"; a hidden sibling must not land inside it.
std::filesystem::path without_trailing_slash(const std::filesystem::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

}  // namespace

AtomicFolder::AtomicFolder(const std::filesystem::path& target, Overwrite overwrite)
    : target_(without_trailing_slash(target)), overwrite_(overwrite) {
  posix::require_replaceable(target_, overwrite_, posix::Kind::Folder);
  temporary_ = posix::create_hidden_folder(target_);
}

AtomicFolder::~AtomicFolder() {
  if (committed_) return;
  std::error_code ignored;  // a destructor has nobody to tell
  std::filesystem::remove_all(temporary_, ignored);
}

void AtomicFolder::commit() {
  if (committed_) throw std::logic_error("AtomicFolder: commit() called twice");
  for (const auto& entry : std::filesystem::recursive_directory_iterator(temporary_)) {
    if (entry.is_symlink()) continue;
    if (entry.is_regular_file() || entry.is_directory()) posix::sync(entry.path());
  }
  posix::sync(temporary_);

  posix::require_replaceable(target_, overwrite_, posix::Kind::Folder);
  const bool replacing = std::filesystem::exists(std::filesystem::symlink_status(target_));
  if (!replacing) {
    posix::rename_to_free_name(temporary_, target_);
  } else if (!posix::exchange(temporary_, target_)) {
    // Without an exchange there is a moment without a folder; the old one can still be found.
    const std::filesystem::path old = posix::hidden_sibling(target_);
    posix::rename_to_free_name(target_, old);
    posix::rename_to_free_name(temporary_, target_);
    temporary_ = old;
  }
  committed_ = true;
  posix::sync(posix::parent_of(target_));
  if (replacing) {
    std::error_code error;
    std::filesystem::remove_all(temporary_, error);  // holds the old folder by now
    if (error) throw FileError(temporary_, "remove", error.message());
  }
}

}  // namespace gonio::files
