#include "gonio/opened_rig/watchdog.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstring>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include "gonio/console/failures.h"
#include "gonio/console/printable.h"
#include "gonio/opened_rig/stop_rig.h"

extern char** environ;

namespace gonio::cli {
namespace {

// Owner to watchdog: path, NUL, text of the rig file, NUL; then nothing until kDismissed, or the
// end of the stream, which is the owner's death. Watchdog to owner: kWatching.
constexpr char kEndOfText = '\0';
constexpr char kDismissed = 'd';
constexpr char kWatching = 'w';
/// A program that others keep from running has taken more than 5 s to begin.
constexpr std::chrono::seconds kStartTimeout{30};
constexpr std::size_t kMaxTextBytes = 4 << 20;

bool send_all(int socket, const std::string& bytes) {
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = ::send(socket, bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return false;
    sent += static_cast<std::size_t>(count);
  }
  return true;
}

/// One byte; nothing at the end of the stream.
std::optional<char> receive_byte(int socket) {
  char byte = 0;
  while (true) {
    const ssize_t count = ::recv(socket, &byte, 1, 0);
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) return std::nullopt;
    return byte;
  }
}

std::optional<std::string> receive_text(int socket) {
  std::string text;
  while (text.size() < kMaxTextBytes) {
    const std::optional<char> byte = receive_byte(socket);
    if (!byte) return std::nullopt;
    if (*byte == kEndOfText) return text;
    text += *byte;
  }
  return std::nullopt;
}

/// What ends a whole terminal or job must not end the one who is to clean up after it.
void outlive_the_terminal() {
  ::setsid();
  for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGPIPE, SIGTSTP}) {
    std::signal(signal, SIG_IGN);
  }
}

void say(const std::string& line) {
  const std::string text = "gonio watchdog: " + printable_line(line) + "\n";
  [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, text.data(), text.size());
}

}  // namespace

Watchdog::Watchdog(const RigFile& rig, const std::vector<int>& held,
                   std::function<void()> on_lost) {
  std::array<int, 2> pair{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair.data()) != 0) {
    throw std::system_error(errno, std::generic_category(), "watchdog: socketpair");
  }
  socket_ = pair[0];
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pair[1], STDIN_FILENO);
  // Onto itself: not closed there.
  for (const int each : held) posix_spawn_file_actions_adddup2(&actions, each, each);
  std::array<char*, 3> arguments{const_cast<char*>("gonio"), const_cast<char*>(kWatchdogArgument),
                                 nullptr};
  const int failed =
      ::posix_spawn(&pid_, "/proc/self/exe", &actions, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(pair[1]);
  const auto give_up = [&](const std::string& why) {
    ::close(socket_);
    if (failed == 0) ::waitpid(pid_, nullptr, 0);
    throw std::runtime_error("watchdog: " + why);
  };
  if (failed != 0) give_up(std::strerror(failed));
  if (!send_all(socket_, rig.path.string() + kEndOfText + rig_file_text(rig, false) + kEndOfText)) {
    give_up("it ended before it had read the rig file");
  }
  pollfd answer{socket_, POLLIN, 0};
  int ready = 0;
  do {
    ready = ::poll(&answer, 1, static_cast<int>(std::chrono::milliseconds(kStartTimeout).count()));
  } while (ready < 0 && errno == EINTR);
  if (ready != 1 || receive_byte(socket_) != kWatching) {
    ::kill(pid_, SIGKILL);
    give_up(fmt::format(
        "the process that stops the rig if this one dies was not ready within {} s; nothing has "
        "moved: try again, with less else to do for this computer",
        kStartTimeout.count()));
  }
  wake_ = ::eventfd(0, EFD_CLOEXEC);
  if (wake_ < 0) give_up(std::strerror(errno));
  looking_ = std::thread([this, on_lost = std::move(on_lost)] { look_after(on_lost); });
}

void Watchdog::look_after(const std::function<void()>& on_lost) const {
  std::array<pollfd, 2> watched{pollfd{socket_, POLLRDHUP, 0}, pollfd{wake_, POLLIN, 0}};
  while (::poll(watched.data(), watched.size(), -1) < 0 && errno == EINTR) {
  }
  if (watched[1].revents == 0) on_lost();
}

Watchdog::~Watchdog() {
  const std::uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(wake_, &one, sizeof one);
  looking_.join();
  ::close(wake_);
  if (!acts_) send_all(socket_, std::string(1, kDismissed));
  ::close(socket_);
  while (::waitpid(pid_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

int run_watchdog() {
  outlive_the_terminal();
  try {
    const std::optional<std::string> path = receive_text(STDIN_FILENO);
    const std::optional<std::string> text = path ? receive_text(STDIN_FILENO) : std::nullopt;
    if (!text) return kFailure;  // the owner was gone before it had opened anything
    const RigStopper rig(rig_file_from_text(*text, *path));
    if (!send_all(STDIN_FILENO, std::string(1, kWatching))) return kFailure;
    if (receive_byte(STDIN_FILENO) == kDismissed) return kSuccess;

    const std::vector<std::string> failures = rig.stop();
    say(fmt::format("the program that drove {} is gone: {}", rig.rig_name(),
                    failures.empty() ? "all axes were sent their stop, the shutter is closed"
                                     : "not everything could be stopped; switch the rig off"));
    for (const std::string& failure : failures) say(failure);
    return failures.empty() ? kSuccess : kDeviceFailure;
  } catch (const std::exception& error) {
    say(describe(error).message);
    return kFailure;
  }
}

}  // namespace gonio::cli
