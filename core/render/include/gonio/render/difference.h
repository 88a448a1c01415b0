#pragma once

#include "gonio/render/image.h"
#include "gonio/render/sphere_picture.h"

namespace gonio::render {

/// Where two pictures differ to the eye, in false colour.
struct DifferencePicture {
  Image image;          ///< heat_colour(delta E / full_scale), alpha as the pictures'
  double mean_delta_e;  ///< CIEDE2000 over pixels wholly on the sphere, as developed
  double p95_delta_e;   ///< 95 % of these pixels differ by less
};

/// 1 is just noticeable side by side; the scale ends where nobody calls it the same colour.
constexpr double kDifferenceScale = 10.0;

/// Both developed with the same exposure. Throws std::invalid_argument when sizes differ or the
/// scale is not positive.
DifferencePicture difference_picture(const SpherePicture& reference, const SpherePicture& other,
                                     double exposure, double full_scale = kDifferenceScale);

/// A scale from near black through violet, red and orange to pale yellow, rising evenly in
/// lightness so that it also reads in grey. `t` is clamped to [0, 1].
Rgba8 heat_colour(double t);

/// The scale as a picture, 0 at the left.
Image heat_bar(int width, int height);

}  // namespace gonio::render
