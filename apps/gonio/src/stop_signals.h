#pragma once

#include <stop_token>
#include <thread>

namespace gonio::cli {

/// While one of these lives, SIGINT and SIGTERM ask for a stop instead of ending the program.
///
/// Threads  One at a time in a program.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  std::stop_token token() const { return source_.get_token(); }
  bool asked() const { return source_.stop_requested(); }

 private:
  std::stop_source source_;
  std::jthread watcher_;  ///< a signal handler may not do what a stop has to
};

}  // namespace gonio::cli
