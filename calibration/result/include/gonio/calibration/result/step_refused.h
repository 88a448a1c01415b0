#pragma once

#include <stdexcept>

namespace gonio::calibration {

/// A calibration step will not make a result of what it was given: too little, contradictory, or
/// not what the step looks at. An expected outcome of a bad mounting or a fault, so whoever runs
/// the step shows it and goes on; nothing is stored.
///
/// what() is one line: what was found, what is expected, what to do.
class StepRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

}  // namespace gonio::calibration
