#pragma once

#include <string>

#include "gonio/calibration/radiometry/verification.h"

namespace gonio::calibration {

/// What explains a failed verification best.
struct LikelyCause {
  Cause cause = Cause::unknown;
  std::string explanation;  ///< one line for a person; names the axis
  double explained = 0.0;   ///< share of the residuals' chi^2 that the cause takes away
};

/// Every cause is a change of the forward model whose size is fitted to all residuals of white and
/// mirror together. All are held against the same residuals, at the same price per size: those that
/// lie on the white whichever of them is right.
LikelyCause likely_cause(const instrument::Instrument& instrument, const VerificationData& data);

}  // namespace gonio::calibration
