#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "command.h"
#include "gonio/calibration/routine/routine.h"
#include "gonio/calibration_report/calibration_report.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/rig_file.h"

namespace gonio::cli {

instrument::UtcSeconds now_utc();

/// A routine about the rig file's nominal constants in `folder`, for the devices that are open.
/// Throws as calibration::routine::Routine, blaming the folder.
calibration::routine::Routine calibration_in(const calibration::routine::Folder& folder,
                                             const RigFile& rig,
                                             calibration::routine::RoutineSettings settings,
                                             OpenedRig& opened);

/// What steps are taken with.
struct StepBench {
  const Context& context;
  calibration::routine::Routine& calibration;
  const acquisition::DeviceSet& devices;
  /// A simulated world that keeps no pace: the lamp's hour of warm-up passes in seconds.
  bool at_once = false;
};

/// Takes steps in the order given, with progress on the console, until one is refused: which and
/// why; nothing when all have passed. Throws UsageError for a step whose inputs are missing.
std::optional<calibration_report::RefusedStep> take_steps(const StepBench& bench,
                                                          const std::vector<std::string>& steps);

/// The same for all that has to be taken, asking again after each: what was taken may call for
/// others, and one that takes hours may see the first expire.
std::optional<calibration_report::RefusedStep> take_open_steps(const StepBench& bench);

/// As StepBench::at_once.
bool passes_at_once(const RigFile& rig);

std::filesystem::path report_in(const std::filesystem::path& folder);

/// FOLDER/report.html: what a person looks at before trusting the numbers.
void write_calibration_report(const calibration::routine::Routine& calibration,
                              const std::filesystem::path& folder, const RigFile& rig,
                              std::vector<calibration_report::RefusedStep> refused);

}  // namespace gonio::cli
