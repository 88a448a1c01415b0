#pragma once

#include <vector>

#include "gonio/calibration/radiometry/verification.h"

namespace gonio::calibration {

/// What the white's pictures have to say among themselves, whatever the certificate's table:
/// the first pose repeated at the end (0.3 %, lamp monitor divided out), poses in which light and
/// camera have changed places (Helmholtz reciprocity, 1 %), and the white's directional albedo at
/// the level at which it was seen, which cannot be above 1 (energy, 2 %). Of the channels the one
/// that is farthest off; what no views of `data` can say is left out.
///
/// `data.white`  As require_white_views() wants it.
std::vector<RatioCheck> white_ratios(const instrument::Instrument& instrument,
                                     const VerificationData& data);

}  // namespace gonio::calibration
