#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "command.h"
#include "gonio/basis/basis.h"
#include "gonio/monitor/http_server.h"
#include "gonio/monitor/session_page.h"
#include "session_run.h"

namespace gonio::cli {

/// Where the live page listens unless told.
inline constexpr std::uint16_t kMonitorPort = 8760;

struct MonitorOptions {
  std::optional<std::uint16_t> port;  ///< none: no page
  std::string address;                ///< empty: loopback
  std::string basis;                  ///< of the growing reconstruction; empty: none
};

/// --monitor [PORT], which does `what`, and --monitor-address.
void add_page_options(const Command& command, MonitorOptions& options, const std::string& what);
/// The same for the live page of a session, and --basis.
void add_monitor_options(const Command& command, MonitorOptions& options);

/// The address to listen on; a warning when others can reach it. Throws UsageError.
monitor::HttpAddress monitor_address(const Console& console, const MonitorOptions& options);

/// Runs `listen`, which starts a page. Throws UsageError when it cannot listen.
void listening(const std::function<void()>& listen);

/// The live page of a session, and what it shows.
class LiveSession {
 public:
  /// Reads the basis, listens and prints where. Throws UsageError before anything moves.
  LiveSession(const Console& console, const MonitorOptions& options, const SessionSetup& session,
              monitor::SessionControls controls);

  monitor::SessionMonitor& monitor() { return *monitor_; }
  /// Tells the page how the session ended, and lets who looks on see it.
  void end(const std::string& how);

 private:
  std::unique_ptr<monitor::SessionMonitor> monitor_;
  std::unique_ptr<monitor::GrowingReconstruction> reconstruction_;
  std::unique_ptr<monitor::SessionPage> page_;
};

/// Null when no page is asked for.
std::unique_ptr<LiveSession> live_session(const Console& console, const MonitorOptions& options,
                                          const SessionSetup& session,
                                          monitor::SessionControls controls);

}  // namespace gonio::cli
