#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>

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
///
/// `bad_pixels`  As instrument::bad_pixel_mask(), or empty. What their neighbours hold stands for
///               them, and for a pixel that is bright alone, which no lens draws: before the map of
///               bad pixels is known, hot ones neither are a highlight nor draw one.
/// `expected_radius_px`  Of the lamp's image; a spot of more than four times that is none.
std::optional<Highlight> find_highlight(const devices::Frame& frame,
                                        std::span<const std::uint8_t> bad_pixels,
                                        double black_level_dn, double expected_radius_px);

/// Sum over a Gaussian window of `sigma_px` about `centre`, above black: what a soft round aperture
/// there would let through. `bad_pixels` as for find_highlight().
double windowed_sum(const devices::Frame& frame, std::span<const std::uint8_t> bad_pixels,
                    double black_level_dn, const Eigen::Vector2d& centre, double sigma_px);

}  // namespace gonio::calibration::routine
