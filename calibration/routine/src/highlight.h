#pragma once

#include <Eigen/Core>
#include <optional>

#include "gonio/devices/frame.h"

namespace gonio::calibration::routine {

/// The lamp's image in something polished.
struct Highlight {
  Eigen::Vector2d pixel;  ///< centroid; whole numbers at pixel centres
  double sum_dn = 0.0;    ///< above what surrounds it
  double radius_px = 0.0;
};

/// The only bright spot of a frame: none when nothing stands out or the spot touches the border.
/// Throws StepRefused: bright all over (no mirror is there), a spot that is saturated.
/// `expected_radius_px`  of the lamp's image; a spot of more than four times that is none.
std::optional<Highlight> find_highlight(const devices::Frame& frame, double black_level_dn,
                                        double expected_radius_px);

/// Sum over a Gaussian window of `sigma_px` about `centre`, above black: what a soft round aperture
/// there would let through.
double windowed_sum(const devices::Frame& frame, double black_level_dn,
                    const Eigen::Vector2d& centre, double sigma_px);

}  // namespace gonio::calibration::routine
