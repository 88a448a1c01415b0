#pragma once

#include <optional>
#include <vector>

#include "gonio/instrument/instrument.h"
#include "gonio/rig/kinematics.h"

namespace gonio::calibration {

/// One pixel, or the mean of a few neighbours, of a merged bracket.
struct PixelSignal {
  double column = 0.0;
  double row = 0.0;
  double dn_per_s = 0.0;  ///< above dark and ambient light
  double sigma_dn_per_s = 0.0;
};

/// The white tile in one pose, one lamp channel.
struct WhiteView {
  rig::Joints joints;
  int channel = 0;       ///< index of the lamp's channel, 0 to 2, and of the white's colour
  double monitor = 1.0;  ///< the lamp monitor's reading, above 0
  std::vector<PixelSignal> pixels;
  double exposure_s = 1.0;  ///< of the picture; above 0
};

/// What a signal is divided by for the instrument constant, and where the pixel looks.
struct WhiteFactor {
  /// monitor * (f_w * V I cos theta_i / r^2, and stray light): signal = C * per_constant
  double per_constant;
  double lamp_x;  ///< tangents of the angle from the lamp's axis about its own x and y
  double lamp_y;
  double camera_q;  ///< squared tangent of the field angle, as in instrument::Vignetting
};

/// With `instrument`'s fields and white; none where the pixel does not see the lit front of the
/// white.
std::optional<WhiteFactor> white_factor(const instrument::Instrument& instrument,
                                        const WhiteView& view, const PixelSignal& pixel);

/// Throws StepRefused, naming the view by its index: no views or pixels, signals, sigmas, monitors
/// or exposures that are not finite and positive, a channel that is none, a wrong number of joints.
void require_white_views(const instrument::Instrument& instrument,
                         const std::vector<WhiteView>& views);

}  // namespace gonio::calibration
