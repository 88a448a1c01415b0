#pragma once

#include <optional>

#include "gonio/calibration/radiometry/verification.h"

namespace gonio::calibration {

/// What the white's pictures have to say among themselves and of their level, the worst of the
/// channels; what no views of `data` can say is left out.
struct WhiteRatios {
  std::optional<RatioCheck> repeat;  ///< the first pose at the end, monitor divided out: 0.3 %
  /// Poses in which light and camera have changed places (Helmholtz), whatever the table says: 1 %.
  /// A factor on the BRDF shows in it by how much it differs with both exchanged, on a white as on
  /// any other target: one of theta_o alone does, one that is symmetric (cos theta_i cos theta_o)
  /// does not.
  std::optional<RatioCheck> reciprocity;
  /// Light from 45 deg thrown back into all directions, over the certificate's
  /// (hemispherical_reflectance.h): 0.75 %.
  std::optional<RatioCheck> hemisphere;
  /// The same over 1, as far as it is above: twice its sigma, the certificate's in it. The level is
  /// the certificate's: besides a rig that the check before finds, it shows a certificate that
  /// cannot be.
  std::optional<RatioCheck> energy;
};

/// `data.white`  As require_white_views() wants it.
WhiteRatios white_ratios(const instrument::Instrument& instrument, const VerificationData& data);

}  // namespace gonio::calibration
