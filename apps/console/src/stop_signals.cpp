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
constexpr char kInterrupt = 'i';
constexpr char kEnd = 'e';
std::array<int, 2> g_pipe{-1, -1};  // handlers can reach nothing but globals

extern "C" void on_stop_signal(int signal) {
  const int saved = errno;
  const char what = signal == SIGINT ? kInterrupt : kSignal;
  [[maybe_unused]] const ssize_t written = ::write(g_pipe[1], &what, 1);
  errno = saved;
}

enum class Times { once, always };

void handle(int signal, void (*handler)(int), Times times) {
  struct sigaction action {};
  action.sa_handler = handler;
  sigemptyset(&action.sa_mask);
  action.sa_flags = static_cast<int>(times == Times::once ? SA_RESTART | SA_RESETHAND : SA_RESTART);
  ::sigaction(signal, &action, nullptr);
}

void handle_all(void (*handler)(int)) {
  handle(SIGINT, handler, Times::once);
  handle(SIGTERM, handler, Times::once);
  handle(SIGQUIT, handler, Times::once);
  handle(SIGHUP, handler, Times::once);  // a terminal or connection that closes
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
      if (what == kInterrupt) {
        on_interrupt();
      } else {
        source_.request_stop();
      }
    }
  });
  handle_all(on_stop_signal);
}

std::stop_token StopSignals::pause_on_interrupt() {
  may_pause_ = true;
  handle(SIGINT, on_stop_signal, Times::always);
  return pause_.get_token();
}

/// On the watcher's thread.
void StopSignals::on_interrupt() {
  if (may_pause_ && pause_.request_stop()) return;
  // Stopping may hang on a device: the next one ends the program.
  handle(SIGINT, SIG_DFL, Times::once);
  source_.request_stop();
}

StopSignals::~StopSignals() {
  handle_all(SIG_DFL);
  [[maybe_unused]] const ssize_t written = ::write(g_pipe[1], &kEnd, 1);
  watcher_.join();
  ::close(g_pipe[0]);
  ::close(g_pipe[1]);
}

}  // namespace gonio::cli
