#pragma once

#include <string>

namespace gonio::instrument {

/// One limit that a calibration step's result is held against. A result beyond its limit is still a
/// result, which a person can look at; it is not stored as passed.
struct AcceptanceCheck {
  std::string name;  ///< quantity and unit: "black level stability (DN)"
  double limit = 0.0;
  double found = 0.0;

  bool passed() const { return found <= limit; }  ///< never for a number that is none
};

}  // namespace gonio::instrument
