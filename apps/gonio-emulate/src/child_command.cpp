#include "child_command.h"

#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <thread>

extern char** environ;

namespace gonio::emulate {
namespace {

constexpr std::array<int, 2> kPassedOn{SIGTERM, SIGHUP};
constexpr int kNotFound = 127;
// A watchdog may try for half a minute; more than this and something hangs.
constexpr std::chrono::seconds kPatience{40};
constexpr std::chrono::milliseconds kPoll{20};

std::atomic<pid_t> g_child = -1;  // a signal handler can reach nothing but globals

extern "C" void pass_on(int signal) {
  const int saved = errno;
  if (g_child > 0) ::kill(g_child, signal);
  errno = saved;
}

/// Holds back what is passed on, while there is no child or one that is being buried.
class SignalsHeld {
 public:
  SignalsHeld() {
    sigset_t held;
    sigemptyset(&held);
    for (const int signal : kPassedOn) sigaddset(&held, signal);
    ::pthread_sigmask(SIG_BLOCK, &held, &before_);
  }
  ~SignalsHeld() { restore(); }
  SignalsHeld(const SignalsHeld&) = delete;
  SignalsHeld& operator=(const SignalsHeld&) = delete;

  void restore() const { ::pthread_sigmask(SIG_SETMASK, &before_, nullptr); }

 private:
  sigset_t before_{};
};

std::vector<std::string> merged_environment(const std::map<std::string, std::string>& additions) {
  std::vector<std::string> all;
  for (char** each = environ; *each != nullptr; ++each) {
    const std::string entry(*each);
    if (!additions.contains(entry.substr(0, entry.find('=')))) all.push_back(entry);
  }
  for (const auto& [name, value] : additions) all.push_back(name + "=" + value);
  return all;
}

std::vector<char*> pointers(std::vector<std::string>& texts) {
  std::vector<char*> all;
  for (std::string& text : texts) all.push_back(text.data());
  all.push_back(nullptr);
  return all;
}

int exit_code(int status) {
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

}  // namespace

ChildCommand::ChildCommand(const std::vector<std::string>& words,
                           const std::map<std::string, std::string>& environment) {
  // Everything is made ready here: after a fork among threads nothing may be allocated.
  std::vector<std::string> arguments = words;
  std::vector<std::string> variables = merged_environment(environment);
  const std::vector<char*> argv = pointers(arguments);
  const std::vector<char*> envp = pointers(variables);
  const std::string complaint = fmt::format("gonio-emulate: {}: cannot run it\n", words.front());
  const pid_t parent = ::getpid();

  ::prctl(PR_SET_CHILD_SUBREAPER, 1);
  std::signal(SIGINT, SIG_IGN);
  struct sigaction action {};
  action.sa_handler = pass_on;
  action.sa_flags = SA_RESTART;
  sigemptyset(&action.sa_mask);
  for (const int signal : kPassedOn) ::sigaction(signal, &action, nullptr);

  const SignalsHeld held;
  pid_ = ::fork();
  if (pid_ < 0) throw std::system_error(errno, std::generic_category(), "fork");
  if (pid_ == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGTERM);
    if (::getppid() != parent) ::_exit(kNotFound);  // died before the line above
    for (const int signal : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) ::signal(signal, SIG_DFL);
    held.restore();
    ::execvpe(argv[0], argv.data(), envp.data());
    [[maybe_unused]] const ssize_t written =
        ::write(STDERR_FILENO, complaint.data(), complaint.size());
    ::_exit(kNotFound);
  }
  g_child = pid_;
}

ChildCommand::~ChildCommand() {
  if (pid_ < 0) return;
  ::kill(pid_, SIGTERM);
  wait();
}

int ChildCommand::wait() {
  // It stays a zombie, and its number its own, until nobody signals it any more.
  siginfo_t ended{};
  while (::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOWAIT) < 0 &&
         errno == EINTR) {
  }
  int status = 0;
  {
    const SignalsHeld held;
    g_child = -1;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
  }
  pid_ = -1;
  ended_at_ = std::chrono::steady_clock::now();
  wait_for_the_rest();
  return exit_code(status);
}

void ChildCommand::wait_for_the_rest() {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < deadline) {
    const pid_t ended = ::waitpid(-1, nullptr, WNOHANG);
    if (ended < 0 && errno == ECHILD) return;
    if (ended <= 0) std::this_thread::sleep_for(kPoll);
  }
  std::fputs("gonio-emulate: the command left processes behind that do not end\n", stderr);
}

}  // namespace gonio::emulate
