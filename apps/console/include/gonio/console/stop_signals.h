#pragma once

#include <stop_token>
#include <thread>

namespace gonio::cli {

/// While one of these lives, the first SIGINT or SIGTERM asks for a stop instead of ending the
/// program; the next one of the same kind ends it.
///
/// Threads  One at a time in a program.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  std::stop_token token() const { return source_.get_token(); }

 private:
  std::stop_source source_;
  std::jthread watcher_;  ///< a signal handler may not do what a stop has to
};

}  // namespace gonio::cli
