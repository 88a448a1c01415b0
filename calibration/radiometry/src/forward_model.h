#pragma once

#include "gonio/calibration/radiometry/verification.h"

namespace gonio::calibration {

/// DN/s that the instrument says the white gives; 0 in the dark or from behind: as wrong as it can
/// be.
double predicted_signal(const instrument::Instrument& instrument, const VerificationData& data,
                        const WhiteView& view, const PixelSignal& pixel);

/// The direction to the lamp that a highlight shows, against where the instrument has the lamp:
/// two small angles across it, rad. Large but finite where the picture and the instrument disagree
/// so much that the plane is seen from behind.
Eigen::Vector2d lamp_error(const instrument::Instrument& instrument, const HighlightView& view);

}  // namespace gonio::calibration
