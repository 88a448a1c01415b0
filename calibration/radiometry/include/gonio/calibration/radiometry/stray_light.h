#pragma once

#include <array>
#include <vector>

#include "gonio/calibration/radiometry/white_view.h"

namespace gonio::calibration {

/// Light that reaches a pixel by other ways than the sample.
struct StrayLight {
  double fraction = 0.0;        ///< of a perfect white under normal incidence at the rig's centre
  double sigma = 0.0;           ///< of the mean
  double spread = 0.0;          ///< sd from pose to pose, beyond what noise explains
  double worst_fraction = 0.0;  ///< of one pose
  int worst_view = 0;           ///< its index
};

/// From views of the black trap, `constant` per channel as FieldFit::constant.
/// Throws   StepRefused: no views, or more than `limit` in a pose (naming it): something shines
///          past the trap.
StrayLight stray_light(const instrument::Instrument& instrument,
                       const std::array<double, 3>& constant,
                       const std::vector<WhiteView>& trap_views, double limit = 0.001);

}  // namespace gonio::calibration
