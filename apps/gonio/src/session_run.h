#pragma once

#include <filesystem>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/acquisition/resume.h"
#include "gonio/acquisition/session.h"
#include "gonio/acquisition/session_archive.h"
#include "gonio/console/console.h"
#include "gonio/instrument/alignment.h"
#include "gonio/monitor/session_monitor.h"
#include "gonio/setup/rig_file.h"
#include "loop_settings.h"
#include "materials_input.h"
#include "session_calibration.h"

namespace gonio::cli {

/// What a session's archive says besides its frames.
struct SessionLabels {
  std::string sample_id;
  std::string operator_name;
  std::string note;
};

/// How a sample's lie is known, for a session's archive.
acquisition::SessionMetadata alignment_metadata(const instrument::Alignment& alignment);

/// A session to run, on the simulated rig or on one of metal.
struct SessionSetup {
  RigFile rig;
  instrument::Instrument instrument;
  acquisition::MeasurementPlan plan;
  std::string plan_text;  ///< stored as it was given
  /// Runs in a world in this process, also where the rig file names devices.
  bool simulated = true;
  SampleMaterial material;  ///< lies on a simulated rig
  std::string material_name;
  std::string material_source;  ///< to be named by again: a file or builtin:NAME; may be empty
  std::uint64_t seed = 1;       ///< of the simulated world
  SessionLabels labels;
  std::filesystem::path archive;  ///< folder to create
  std::optional<SessionCalibration> calibration;
  bool accept_calibration = false;         ///< also one that should not be used
  acquisition::SessionMetadata alignment;  ///< how the sample's lie is known; may be empty
  std::string alignment_refusal;           ///< why that will not do; for a dry run
  SampleMaterial expected;                 ///< the sample is like this; may be nothing
  std::string expected_name;
  std::vector<double> exposures_us;  ///< shortest ones as the plan expects them, or none
  std::vector<acquisition::RefusedDirection> skipped;  ///< that the plan leaves out
  bool skip_unreachable = false;                       ///< and may
  bool ask_person = false;           ///< white placement manual: ask at the terminal
  std::optional<LoopSettings> loop;  ///< none: the plan is measured as it stands
};

/// A session of before to go on with. Its setup is that of its archive.
struct SessionToResume {
  acquisition::ResumeState state;
  acquisition::SessionMetadata metadata;
  files::ProcessLock lock;  ///< session_lock(), taken before the archive was read
  std::chrono::nanoseconds outage{0};
  std::string despite;  ///< why it should not have been, and was; empty: nothing
};

/// Checks and runs it; progress goes to the console. A session that is refused before anything
/// moved leaves no archive and throws UsageError; so is one whose calibration is expired, stale or
/// another rig's, unless it is accepted. With `resumed`, goes on with the archive there is; throws
/// UsageError when the devices are not those it was begun with. `monitor`, if any, is told of it.
acquisition::SessionResult run_session(const Console& console, SessionSetup session,
                                       std::stop_token stop = {}, std::stop_token pause = {},
                                       std::optional<SessionToResume> resumed = std::nullopt,
                                       monitor::SessionMonitor* monitor = nullptr);

}  // namespace gonio::cli
