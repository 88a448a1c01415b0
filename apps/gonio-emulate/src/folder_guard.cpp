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

void send_to_guard(int pipe, const std::string& bytes) {
  [[maybe_unused]] const ssize_t written = ::write(pipe, bytes.data(), bytes.size());
}

/// The guard's life. What ends a whole terminal must not end it, and it must not hold a pipe open
/// that others read to its end.
void guard(int pipe) {
  ::setsid();
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT}) std::signal(signal, SIG_IGN);
  const int nothing = ::open("/dev/null", O_RDWR);
  for (const int descriptor : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    ::dup2(nothing, descriptor);
  }
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
  pipe_ = pipe[1];
  // A grandchild: nobody who waits for the children of this program waits for it.
  const pid_t child = ::fork();
  if (child < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (child == 0) {
    ::close(pipe[1]);
    if (::fork() == 0) guard(pipe[0]);
    ::_exit(0);
  }
  ::close(pipe[0]);
  while (::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
}

FolderGuard::~FolderGuard() {
  send_to_guard(pipe_, std::string(1, kDismissed));
  ::close(pipe_);
}

void FolderGuard::watch(const std::filesystem::path& folder) const {
  send_to_guard(pipe_, folder.string() + kEndOfName);
}

}  // namespace gonio::emulate
