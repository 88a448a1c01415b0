#pragma once

#include <optional>

#include "command.h"
#include "session_run.h"

namespace gonio::cli {

/// Runs a session, new or to be resumed, and tells how it ended; SIGINT pauses it. Returns the exit
/// code. Throws as run_session().
int run_to_the_end(Context& context, const SessionSetup& session,
                   std::optional<SessionToResume> resumed = std::nullopt);

}  // namespace gonio::cli
