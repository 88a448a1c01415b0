#pragma once

#include "gonio/acquisition/resume.h"
#include "session_run.h"

namespace gonio::cli {

/// A session's setup from its archive: what was given at the beginning may have changed since.
/// Without sample and loop, which lie elsewhere. Throws UsageError for one of an earlier version.
SessionSetup stored_setup(const StoredSession& stored);

/// What lies on the rig, as at the beginning. Throws UsageError when the archive does not say what
/// does on a simulated one.
void set_stored_sample(const acquisition::SessionReader& archive, SessionSetup& session);

/// Points that decisions have added, behind the plan's own. They are as the session's own check
/// has found them, or the journal was tampered with: DataFormatError.
void add_decided_points(const acquisition::SessionReader& archive,
                        const acquisition::ResumeState& state, SessionSetup& session);

}  // namespace gonio::cli
