#include "folder_guard.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <string>
#include <system_error>

namespace gonio::emulate {
namespace {

// Owner to guard: the folder, NUL, and at a good end kDismissed.
constexpr char kEndOfName = '\0';
constexpr char kDismissed = 'd';

bool send_to_guard(int pipe, const std::string& bytes) {
  // Below PIPE_BUF a write is whole or an error.
  return ::write(pipe, bytes.data(), bytes.size()) == static_cast<ssize_t>(bytes.size());
}

/// The guard's life. What ends a whole terminal must not end it, and it must not hold anything open
/// that others read to its end.
void guard(int pipe) noexcept {
  ::setsid();
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) std::signal(signal, SIG_IGN);
  const auto own = static_cast<unsigned>(pipe);
  if (own > 0) ::close_range(0, own - 1, 0);
  ::close_range(own + 1, ~0U, 0);
  std::string told;
  std::array<char, 512> bytes{};
  while (true) {
    const ssize_t count = ::read(pipe, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) break;
    told.append(bytes.data(), static_cast<std::size_t>(count));
  }
  if (told.empty() || told.back() != kEndOfName) return;
  told.pop_back();
  std::error_code ignored;
  std::filesystem::remove_all(told, ignored);
}

}  // namespace

FolderGuard::FolderGuard() {
  std::array<int, 2> pipe{};
  if (::pipe2(pipe.data(), O_CLOEXEC) != 0) {
    throw std::system_error(errno, std::generic_category(), "pipe");
  }
  // A grandchild: nobody who waits for the children of this program waits for it.
  const pid_t child = ::fork();
  if (child == 0) {
    ::close(pipe[1]);
    const pid_t grandchild = ::fork();
    if (grandchild == 0) guard(pipe[0]);
    ::_exit(grandchild < 0 ? 1 : 0);
  }
  ::close(pipe[0]);
  int status = child < 0 ? 1 : 0;
  while (child > 0 && ::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (status != 0) {
    ::close(pipe[1]);
    throw std::system_error(EAGAIN, std::generic_category(), "fork");
  }
  pipe_ = pipe[1];
}

FolderGuard::~FolderGuard() {
  send_to_guard(pipe_, std::string(1, kDismissed));  // a guard that has died guards nothing
  ::close(pipe_);
}

void FolderGuard::watch(const std::filesystem::path& folder) const {
  if (!send_to_guard(pipe_, folder.string() + kEndOfName)) {
    throw std::system_error(errno, std::generic_category(), "guard of " + folder.string());
  }
}

}  // namespace gonio::emulate
