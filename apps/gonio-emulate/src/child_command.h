#pragma once

#include <chrono>
#include <map>
#include <string>
#include <vector>

namespace gonio::emulate {

/// Runs a command as a child and waits for it, and then for what it left behind (its watchdog).
///
/// Signals  SIGTERM and SIGHUP are passed on; SIGINT from a terminal reaches the child by itself.
/// The
///          child gets SIGTERM should this process die.
/// Threads  To be called before any other thread is started or from a program whose threads do not
///          mind a fork; one call at a time.
class ChildCommand {
 public:
  /// Starts `words` with these additions to the environment. Throws std::system_error.
  ChildCommand(const std::vector<std::string>& words,
               const std::map<std::string, std::string>& environment);
  ~ChildCommand();
  ChildCommand(const ChildCommand&) = delete;
  ChildCommand& operator=(const ChildCommand&) = delete;

  /// The command's exit code, as a shell tells it: 128 + N for signal N, 127 for no such command.
  int wait();
  /// When it had ended; after wait().
  std::chrono::steady_clock::time_point ended_at() const { return ended_at_; }

 private:
  void wait_for_the_rest();

  int pid_ = -1;
  std::chrono::steady_clock::time_point ended_at_{};
};

}  // namespace gonio::emulate
