#include "gonio/console/stop_signals.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>

namespace gonio::cli {
namespace {

constexpr char kSignal = 's';
constexpr char kEnd = 'e';
std::array<int, 2> g_pipe{-1, -1};  // handlers can reach nothing but globals

extern "C" void on_stop_signal(int) {
  const int saved = errno;
  [[maybe_unused]] const ssize_t written = ::write(g_pipe[1], &kSignal, 1);
  errno = saved;
}

void handle(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  sigemptyset(&action.sa_mask);
  action.sa_flags = static_cast<int>(SA_RESTART | SA_RESETHAND);
  ::sigaction(SIGINT, &action, nullptr);
  ::sigaction(SIGTERM, &action, nullptr);
  ::sigaction(SIGHUP, &action, nullptr);  // a terminal or connection that closes
}

}  // namespace

StopSignals::StopSignals() {
  if (::pipe2(g_pipe.data(), O_CLOEXEC) != 0) {
    throw std::system_error(errno, std::generic_category(), "pipe");
  }
  watcher_ = std::jthread([this] {
    char what = 0;
    while (true) {
      const ssize_t count = ::read(g_pipe[0], &what, 1);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0 || what == kEnd) return;
      source_.request_stop();
    }
  });
  handle(on_stop_signal);
}

StopSignals::~StopSignals() {
  handle(SIG_DFL);
  [[maybe_unused]] const ssize_t written = ::write(g_pipe[1], &kEnd, 1);
  watcher_.join();
  ::close(g_pipe[0]);
  ::close(g_pipe[1]);
}

}  // namespace gonio::cli
