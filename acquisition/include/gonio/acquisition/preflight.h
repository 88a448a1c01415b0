#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/acquisition/forecast.h"
#include "gonio/acquisition/itinerary.h"
#include "gonio/acquisition/session.h"

namespace gonio::acquisition {

enum class CheckResult {
  pass,
  note,   ///< goes on; worth knowing
  refuse  ///< nothing may move
};
std::string_view to_string(CheckResult result);

/// One thing that was looked at before anything moves.
struct Check {
  std::string name;  ///< a word: "path", "exposure", "disk"
  CheckResult result = CheckResult::pass;
  std::string text;  ///< what was found; of a refusal one line with what was expected
};

/// Where an axis goes in a whole session after homing, overshoots of its approach included.
struct AxisUse {
  std::string name;
  Angle lowest;
  Angle highest;
  Angle travelled;  ///< sum of all ways, without sign
  int moves = 0;
};

/// What is expected of a session before it begins.
struct Expectation {
  ExpectedLight light;
  ExpectedSample sample;
  RigTimes times;
};

/// Everything that can be known of a session before anything moves, as data.
struct Preflight {
  std::vector<Check> checks;  ///< in the order they were made; after a refusal some may be missing
  // What was found out on the way; empty when a check before refused.
  std::optional<Itinerary> itinerary;
  std::optional<Forecast> forecast;  ///< with an expectation only
  std::vector<AxisUse> axes;
  DriftAliasing drift;

  /// The first check that refuses; none: it may begin.
  const Check* refusal() const;
};

/// Looks at options, devices against rig and calibration, every point, the white, the way along the
/// whole itinerary, and with an expectation at exposures and duration. Nothing moves.
///
/// Cost     1,000 points some 0.1 s a core.
/// Threads  Any; parallel inside. Errors of devices (DeviceError) are passed on.
Preflight preflight(const DeviceSet& devices, const instrument::Instrument& instrument,
                    const MeasurementPlan& plan, const SessionOptions& options,
                    const Expectation* expectation = nullptr);

/// What run_session() does first: the itinerary of a session that preflight() has nothing against.
/// Throws PreflightError with the first refusal.
Itinerary checked_itinerary(const DeviceSet& devices, const instrument::Instrument& instrument,
                            const MeasurementPlan& plan, const SessionOptions& options,
                            const Expectation* expectation = nullptr);

}  // namespace gonio::acquisition
