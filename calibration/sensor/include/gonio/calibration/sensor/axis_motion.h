#pragma once

#include <span>
#include <vector>

#include "gonio/calibration/result/estimate.h"
#include "gonio/instrument/acceptance_check.h"
#include "gonio/units/angle.h"

namespace gonio::calibration::sensor {

/// One arrival, seen by something else than the axis' own encoder.
struct Approach {
  Angle target;
  bool rising = true;  ///< came from smaller angles
  Angle reading;       ///< of the encoder, there
  Angle observed;
};

struct Repeatability {
  AngleEstimate backlash;        ///< observed after falling minus after rising approaches
  AngleEstimate unidirectional;  ///< sd of arrivals from one side about their target
  AngleEstimate about_reading;   ///< sd of what was observed there about what was read
  Angle bidirectional;           ///< hypot(unidirectional, backlash / 2)
  std::vector<instrument::AcceptanceCheck>
      acceptance;  ///< backlash 0.1 deg, unidirectional 0.01 deg
};

/// Backlash and repeatability of one axis (play model: the shaft follows within +-b/2).
///
/// Method   Play is in what was observed less what was read: where a move ends beside its target is
///          in both. So is it, for whoever uses the readings, not in how well an axis is known.
/// Input    For each target at least two arrivals from either side; three targets at least.
/// Threads  Any.
/// Errors   StepRefused: too few targets or arrivals, angles that are no numbers, a backlash that
/// is
///          negative by more than 3 sigma (the sensor counts the other way).
/// Source   ISO 230-2:2014, unidirectional and bidirectional repeatability (there with k = 2).
Repeatability fit_repeatability(std::span<const Approach> approaches);

/// sd of repeated arrivals at one place: the home mark found ten times.
/// Errors   StepRefused: fewer than five, or no numbers.
AngleEstimate scatter(std::span<const Angle> observed);

struct AngleReading {
  double time_s = 0.0;  ///< since the axis was told to have arrived
  Angle angle;
};

struct SettlingOptions {
  Angle tolerance = Angle::from_degrees(0.002);
};

struct Settling {
  double settled_after_s = 0.0;  ///< last time outside the tolerance
  double sigma_s = 0.0;          ///< from the spacing of the readings
  Angle final_angle;
  Angle ring_amplitude;  ///< largest distance from the final angle
  Angle noise;           ///< sd of the last quarter
};

/// How long an axis rings after a move.
///
/// Method   The final angle is the mean of the last quarter. Outside means by more than the
///          root of the sum of squares of tolerance and 3 sd of the noise, so that noise alone does
///          not count as ringing.
/// Threads  Any.
/// Errors   StepRefused: fewer than 40 readings, times that do not rise, noise above half the
///          tolerance, ringing or drift in the last quarter (record longer).
Settling fit_settling(std::span<const AngleReading> readings, const SettlingOptions& options = {});

}  // namespace gonio::calibration::sensor
