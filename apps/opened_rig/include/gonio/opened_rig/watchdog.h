#pragma once

#include <sys/types.h>

#include "gonio/setup/rig_file.h"

namespace gonio::cli {

/// A small process that outlives this one: should this one die, also by SIGKILL, it opens the rig's
/// axes and lamp, stops the axes and closes the shutter. It opens nothing before that: a serial
/// line has one master.
///
/// State    Watches from construction; the destructor dismisses it, which is for whoever has left
/// the
///          rig safe himself.
/// Threads  One.
class Watchdog {
 public:
  /// Throws std::system_error or std::runtime_error when it cannot be started or does not answer.
  explicit Watchdog(const RigFile& rig);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  pid_t pid() const { return pid_; }

 private:
  int socket_ = -1;
  pid_t pid_ = -1;
};

/// The argument that makes a program its own watchdog, alone on its command line.
inline constexpr const char* kWatchdogArgument = "--watchdog-of-parent";

/// The watchdog's own main(), on the socket it was given as standard input. Returns its exit code.
int run_watchdog();

}  // namespace gonio::cli
