#pragma once

#include <string_view>

#include "gonio/calibration/routine/settings.h"

namespace gonio::calibration::routine {

/// About how long a step takes, for telling what is left; without the time that a person takes to
/// mount its target. Another rig's axes may be twice as fast or as slow.
struct ExpectedTime {
  double on_rig_s = 0.0;  ///< of the rig's own clock, also of a world that keeps a pace
  /// Of a world that passes its time at once: of the processor that draws it, in units of which
  /// only ratios mean something.
  double drawn = 0.0;
};

/// Throws std::invalid_argument for a step that is none.
ExpectedTime expected_time(std::string_view step, const RoutineSettings& settings);

}  // namespace gonio::calibration::routine
