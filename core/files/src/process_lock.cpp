#include "gonio/files/process_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <string>
#include <thread>
#include <utility>

#include "posix.h"

namespace gonio::files {
namespace {

/// Who only asks for the holder has it for microseconds, and must not keep an owner away.
constexpr int kLockAttempts = 5;
constexpr std::chrono::milliseconds kBetweenLockAttempts{10};

constexpr int kForEverybody = 0666;

/// No link is followed: the folder may be one that everybody can write to.
int open_lock(const std::filesystem::path& path) {
  constexpr int kFlags = O_RDWR | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK;
  int descriptor = ::open(path.c_str(), kFlags);
  if (descriptor < 0 && errno == ENOENT) {
    descriptor = ::open(path.c_str(), kFlags | O_CREAT, kForEverybody);
    // Whatever the mask says: the next to drive the rig may be another user. Not ours: no matter.
    if (descriptor >= 0 && ::fchmod(descriptor, kForEverybody) != 0) errno = 0;
  }
  if (descriptor < 0) throw FileError(path, "lock", errno);
  return descriptor;
}

pid_t written_in(int descriptor) {
  std::array<char, 16> text{};
  const ssize_t size = ::pread(descriptor, text.data(), text.size(), 0);
  pid_t holder = 0;
  if (size > 0) std::from_chars(text.data(), text.data() + size, holder);
  return std::max<pid_t>(holder, 0);
}

}  // namespace

ProcessLock::ProcessLock(const std::filesystem::path& path) : descriptor_(open_lock(path)) {
  for (int attempt = 1; ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0; ++attempt) {
    const int error = errno;
    if (error == EWOULDBLOCK && attempt < kLockAttempts) {
      std::this_thread::sleep_for(kBetweenLockAttempts);
      continue;
    }
    const pid_t holder = written_in(descriptor_);
    ::close(std::exchange(descriptor_, -1));
    if (error != EWOULDBLOCK) throw FileError(path, "lock", error);
    throw HeldByAnother(path, holder,
                        holder > 0 ? "process " + std::to_string(holder) + " is using it"
                                   : std::string("another process is using it"));
  }
  const std::string own = std::to_string(::getpid()) + "\n";
  // A full disk keeps the number out, not the lock.
  if (::ftruncate(descriptor_, 0) == 0) {
    [[maybe_unused]] const ssize_t written = ::pwrite(descriptor_, own.data(), own.size(), 0);
  }
}

ProcessLock::ProcessLock(ProcessLock&& other) noexcept
    : descriptor_(std::exchange(other.descriptor_, -1)) {}

ProcessLock::~ProcessLock() {
  if (descriptor_ >= 0) ::close(descriptor_);
}

std::optional<pid_t> lock_holder(const std::filesystem::path& path) {
  const posix::Descriptor descriptor(
      ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (descriptor.get() < 0) return std::nullopt;
  if (::flock(descriptor.get(), LOCK_SH | LOCK_NB) == 0 || errno != EWOULDBLOCK) {
    return std::nullopt;
  }
  return written_in(descriptor.get());
}

bool names_open_file(const std::filesystem::path& path, int descriptor) {
  struct stat open {};
  struct stat named {};
  return ::fstat(descriptor, &open) == 0 && ::lstat(path.c_str(), &named) == 0 &&
         open.st_dev == named.st_dev && open.st_ino == named.st_ino;
}

void sync_folder(const std::filesystem::path& folder) { posix::sync(folder); }

}  // namespace gonio::files
