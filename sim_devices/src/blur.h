#pragma once

#include <cstddef>
#include <vector>

#include "pixel_contents.h"

namespace gonio::sim {

/// One band of a picture: the radiances of `contents`, blurred by a lens whose point spread is a
/// Gaussian, as pixels see them, W m^-2 sr^-1 per 1 W/sr. Beyond the picture its edge goes on.
///
/// Where a pixel and all within reach of the blur show one surface, whose radiance is nearly
/// straight over so short a way, nothing is blurred.
///
/// `sigma_px`  Of the Gaussian; 0: none.
/// `plane`     Row-major; what is there is written over.
void blur(const PixelContents& contents, std::size_t band, double sigma_px,
          std::vector<float>& plane);

}  // namespace gonio::sim
