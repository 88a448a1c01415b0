#pragma once

#include "gonio/acquisition/resume.h"
#include "session_run.h"

namespace gonio::cli {

/// A finished or killed session with what it was made with.
struct StoredSession {
  acquisition::SessionReader archive;
  RigFile rig;
  instrument::Instrument instrument;
};

/// Throws UsageError when the folder is no session (yet).
void require_session(const std::filesystem::path& folder);

/// Throws UsageError when the folder is no session, DataFormatError and ConfigError as its parts.
/// With `calibration`: these constants instead of the stored ones.
StoredSession open_session(const std::filesystem::path& folder,
                           const std::string& calibration = "");
/// The same of one that was read already.
StoredSession stored_session(acquisition::SessionReader archive,
                             const std::string& calibration = "");

// Names in an archive's configuration.
inline constexpr const char* kRigText = "rig.toml";
inline constexpr const char* kPlanText = "plan.csv";    ///< as it was given
inline constexpr const char* kPosesText = "poses.csv";  ///< as it is run (stored_poses())
inline constexpr const char* kCalibrationText = "calibration.json";

/// Metadata by key, or nothing.
std::string metadata(const acquisition::SessionReader& archive, const std::string& key);

/// reduce() with the radiometric scale the session's metadata tell. Throws UsageError where there
/// is nothing to reduce yet, with what to do.
acquisition::Reduction reduce_session(const StoredSession& session,
                                      const acquisition::ReductionOptions& options);

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
