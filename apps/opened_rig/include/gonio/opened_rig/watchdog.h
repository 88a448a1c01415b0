#pragma once

#include <sys/types.h>

#include <functional>
#include <thread>
#include <vector>

#include "gonio/setup/rig_file.h"

namespace gonio::cli {

/// A small process that outlives this one: should this one die, also by SIGKILL, it opens the rig's
/// axes and lamp, stops the axes and closes the shutter. It opens nothing before that: a serial
/// line has one master.
///
/// State    Watches from construction; the destructor dismisses it, for owners who have left the
/// rig
///          safe themselves, unless leave_to_act() was called.
/// Threads  One, beside its own.
class Watchdog {
 public:
  /// `held` are descriptors that it keeps open until it has ended: locks on the rig, which is
  /// nobody else's until then. `on_lost` is called once, on a thread of its own, should the
  /// watchdog itself die: from then on nobody would stop the rig. Throws std::system_error or
  /// std::runtime_error when it cannot be started or does not answer.
  Watchdog(const RigFile& rig, const std::vector<int>& held, std::function<void()> on_lost);
  ~Watchdog();
  Watchdog(const Watchdog&) = delete;
  Watchdog& operator=(const Watchdog&) = delete;

  pid_t pid() const { return pid_; }
  /// The destructor shall not dismiss it: the rig could not be left safe, its ports are closed.
  void leave_to_act() { acts_ = true; }

 private:
  void look_after(const std::function<void()>& on_lost) const;

  int socket_ = -1;
  int wake_ = -1;  ///< ends the thread
  pid_t pid_ = -1;
  bool acts_ = false;
  std::thread looking_;
};

/// The argument that makes a program its own watchdog, alone on its command line.
inline constexpr const char* kWatchdogArgument = "--watchdog-of-parent";

/// The watchdog's own main(), on the socket it was given as standard input. Returns its exit code.
int run_watchdog();

}  // namespace gonio::cli
