#pragma once

#include <functional>
#include <vector>

#include "gonio/acquisition/forecast.h"

namespace gonio::acquisition {

/// What one region of the target is expected to show in one channel.
struct ExpectedRegion {
  double mean_dn_per_s = 0.0;     ///< above black
  double maximum_dn_per_s = 0.0;  ///< of its brightest place and colour of pixel
  double pixels = 0.0;
};

/// A square of the sample plane, divided as regions_of() divides it.
struct TargetSquare {
  Eigen::Vector2d centre_mm{0.0, 0.0};
  double half_width_mm = 0.0;
  int grid = 3;  ///< grid x grid regions
};

/// Where the white is looked at.
TargetSquare white_square(const SessionOptions& options);

/// Per channel of `light` the regions of the target that the camera sees, without looking at every
/// pixel: a few places of each region stand for it, the slope of the image for its number of
/// pixels. Empty channels when the camera sees none of it.
std::vector<std::vector<ExpectedRegion>> expected_regions(
    const instrument::Instrument& instrument, const rig::RigPose& pose, const TargetSquare& square,
    devices::PixelFormat format, const ExpectedLight& light,
    const std::function<brdf::Rgb(const brdf::DirectionPair&)>& brdf);

}  // namespace gonio::acquisition
