#pragma once

#include "gonio/units/angle.h"

namespace gonio::calibration {

/// A number found by a calibration step. The field that holds it names the quantity and its unit.
struct Estimate {
  double value = 0.0;
  double sigma = 0.0;  ///< standard uncertainty (k = 1), in the unit of `value`
};

struct AngleEstimate {
  Angle value;
  Angle sigma;  ///< standard uncertainty (k = 1)
};

}  // namespace gonio::calibration
