#include "posix.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <string>

#include "gonio/errors/errors.h"

namespace gonio::files::posix {
namespace {

constexpr int kAttempts = 1000;           // at free hidden names
constexpr std::size_t kKeptOfName = 200;  // names end at 255 bytes, ours adds to the user's

/// Calls create(path) with fresh hidden names until one is free. Returns it.
template <typename Create>
std::filesystem::path create_hidden(const std::filesystem::path& target, Create&& create) {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    std::filesystem::path hidden = hidden_sibling(target);
    if (create(hidden)) return hidden;
    const int error = errno;
    if (error != EEXIST) throw FileError(target, "create", error);
  }
  throw FileError(target, "create", "no free temporary name beside it");
}

}  // namespace

Descriptor::~Descriptor() {
  if (value_ >= 0) ::close(value_);
}

std::filesystem::path parent_of(const std::filesystem::path& path) {
  const std::filesystem::path parent = path.parent_path();
  return parent.empty() ? std::filesystem::path(".") : parent;
}

std::filesystem::path hidden_sibling(const std::filesystem::path& target) {
  static std::atomic<unsigned> counter = 0;
  const std::string name = target.filename().string().substr(0, kKeptOfName);
  return parent_of(target) / ("." + name + "." + std::to_string(::getpid()) + "-" +
                              std::to_string(counter.fetch_add(1)) + ".part");
}

void require_replaceable(const std::filesystem::path& target, Overwrite overwrite, Kind kind) {
  const std::string name = target.filename().string();
  if (name.empty() || name == "." || name == "..") {
    throw FileError(target, "create", "the path names no file");
  }
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::symlink_status(target, error);
  if (status.type() == std::filesystem::file_type::not_found) return;
  if (error) throw FileError(target, "create", error.message());
  if (overwrite == Overwrite::No) throw FileError(target, "create", "it exists");

  // A link is judged by what it points to; renaming then replaces the link itself.
  const bool replaceable = kind == Kind::File ? std::filesystem::is_regular_file(target, error)
                                              : std::filesystem::is_directory(status);
  if (!replaceable) {
    throw FileError(target, "replace",
                    kind == Kind::File ? "it is not a regular file" : "it is not a folder");
  }
}

std::filesystem::path create_hidden_file(const std::filesystem::path& target, int& descriptor) {
  return create_hidden(target, [&](const std::filesystem::path& hidden) {
    descriptor = ::open(hidden.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    return descriptor >= 0;
  });
}

std::filesystem::path create_hidden_folder(const std::filesystem::path& target) {
  return create_hidden(target, [](const std::filesystem::path& hidden) {
    return ::mkdir(hidden.c_str(), 0777) == 0;
  });
}

void sync(const std::filesystem::path& path) {
  const Descriptor descriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (descriptor.get() < 0) throw FileError(path, "open for reading", errno);
  // EINVAL: the file system has nothing to sync for this kind of entry.
  if (::fsync(descriptor.get()) != 0 && errno != EINVAL) throw FileError(path, "sync", errno);
}

void rename_to_free_name(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return;
  const int error = errno;
  if (error == EEXIST) throw FileError(to, "create", "it exists");
  if (error != EINVAL && error != ENOSYS && error != ENOTSUP) throw FileError(to, "create", error);
  // Some network file systems know only the plain call. The check leaves a gap of microseconds.
  require_replaceable(to, Overwrite::No, Kind::File);
  if (::rename(from.c_str(), to.c_str()) != 0) throw FileError(to, "create", errno);
}

bool exchange(const std::filesystem::path& one, const std::filesystem::path& other) {
  return ::renameat2(AT_FDCWD, one.c_str(), AT_FDCWD, other.c_str(), RENAME_EXCHANGE) == 0;
}

}  // namespace gonio::files::posix
