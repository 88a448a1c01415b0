#pragma once

#include <atomic>
#include <stop_token>
#include <thread>

namespace gonio::cli {

/// While one of these lives, the first SIGINT, SIGTERM, SIGQUIT or SIGHUP asks for a stop instead
/// of ending the program; the next one of the same kind ends it. For work that can pause, the first
/// SIGINT asks for that only, the second for the stop, and the third ends the program.
///
/// Threads  One at a time in a program.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  std::stop_token token() const { return source_.get_token(); }
  /// From here on SIGINT first asks for a pause: this one.
  std::stop_token pause_on_interrupt();

 private:
  void on_interrupt();

  std::stop_source source_;
  std::stop_source pause_;
  std::atomic<bool> may_pause_ = false;
  std::jthread watcher_;  ///< a signal handler may not do what a stop has to
};

}  // namespace gonio::cli
