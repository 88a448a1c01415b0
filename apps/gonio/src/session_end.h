#pragma once

#include <optional>

#include "command.h"
#include "monitoring.h"
#include "session_run.h"

namespace gonio::cli {

/// Runs a session, new or to be resumed, with a live page if wanted, and tells how it ended; SIGINT
/// pauses it, and so may the page. Returns the exit code. Throws as run_session() and LiveSession.
int run_to_the_end(Context& context, const SessionSetup& session, const MonitorOptions& watching,
                   std::optional<SessionToResume> resumed = std::nullopt);

}  // namespace gonio::cli
