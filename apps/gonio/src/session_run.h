#pragma once

#include <filesystem>
#include <stop_token>
#include <string>

#include "gonio/acquisition/session.h"
#include "gonio/acquisition/session_archive.h"
#include "gonio/console/console.h"
#include "gonio/setup/rig_file.h"
#include "materials_input.h"

namespace gonio::cli {

/// What a session's archive says besides its frames.
struct SessionLabels {
  std::string sample_id;
  std::string operator_name;
  std::string note;
};

/// A session on the simulated rig.
struct SimulatedSession {
  RigFile rig;
  instrument::Instrument instrument;
  acquisition::MeasurementPlan plan;
  std::string plan_text;  ///< stored as it was given
  SampleMaterial material;
  std::string material_name;
  std::uint64_t seed = 1;
  SessionLabels labels;
  std::filesystem::path archive;  ///< folder to create
  bool ask_person = false;        ///< white placement manual: ask at the terminal
};

/// The check before anything moves, alone. Throws UsageError.
void check_simulated(const SimulatedSession& session);

/// Checks and runs it; progress goes to the console. A session that is refused before anything
/// moved leaves no archive and throws UsageError.
acquisition::SessionResult run_simulated(const Console& console, const SimulatedSession& session,
                                         std::stop_token stop = {});

/// A finished or killed session with what it was made with.
struct StoredSession {
  acquisition::SessionReader archive;
  RigFile rig;
  instrument::Instrument instrument;
};

/// Throws UsageError when the folder is no session, DataFormatError and ConfigError as its parts.
/// With `calibration`: these constants instead of the stored ones.
StoredSession open_session(const std::filesystem::path& folder,
                           const std::string& calibration = "");

/// Metadata by key, or nothing.
std::string metadata(const acquisition::SessionReader& archive, const std::string& key);

/// reduce() with the radiometric scale the session's metadata tell.
acquisition::Reduction reduce_session(const StoredSession& session,
                                      const acquisition::ReductionOptions& options);

}  // namespace gonio::cli
