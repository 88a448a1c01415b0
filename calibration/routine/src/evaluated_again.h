#pragma once

#include "gonio/instrument/calibration_archive.h"

namespace gonio::calibration::routine {

/// What belongs to the taking and not to its evaluation: when it was, what it rested on and was
/// told, what was seen, what the devices said.
void take_over_taking(const instrument::StepResult& from, instrument::StepResult& to);

/// Both say the same of what was seen: the same parameters, residuals and checks, to a thousandth
/// of a sigma or a millionth.
bool same_numbers(const instrument::StepResult& one, const instrument::StepResult& other);

}  // namespace gonio::calibration::routine
