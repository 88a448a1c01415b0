#pragma once

#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/disk.h"
#include "gonio/acquisition/preflight.h"
#include "session_run.h"

namespace gonio::cli {

/// What a session on this rig file is expected to be like: light and times by the file, the sample
/// by what the session's setup says of it, else by nothing but that it is between black and
/// polished.
acquisition::Expectation expectation_of(const SessionSetup& session);

/// The pre-run check of a session with all that the program knows besides acquisition: calibration,
/// alignment, directions left out, the order against its bound, disk.
struct SessionPreflight {
  acquisition::Preflight found;
  std::optional<acquisition::DiskUse> disk;
  double points_travel_s = 0.0;  ///< from the white over the points and back to it
  double lower_bound_s = 0.0;    ///< no order of these points can take less
};

/// `points_done`  Of a session to go on with: they take no more disk.
SessionPreflight preflight_session(const acquisition::DeviceSet& devices,
                                   const SessionSetup& session, std::size_t points_done = 0);

/// The same on a simulated rig, even for one of metal: nothing is opened, nothing is written.
SessionPreflight preflight_session(const SessionSetup& session);

/// "3 min 20 s, 90 % within 3 min 5 s to 4 min 1 s".
std::string to_text(const acquisition::Estimate& duration);

/// Puts the forecast's times into the plan.
void use_forecast(const acquisition::Forecast& forecast, acquisition::MeasurementPlan& plan);

}  // namespace gonio::cli
