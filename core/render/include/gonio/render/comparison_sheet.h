#pragma once

#include <string>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/render/image.h"
#include "gonio/render/sphere_picture.h"

namespace gonio::render {

/// What to put on a sheet. Names are drawn in capitals; what has no letter here becomes a blank.
struct SheetOptions {
  int sphere_size = 320;  ///< pixels, in [64, 1024]
  std::vector<PictureLighting> lightings = {PictureLighting::studio, PictureLighting::a,
                                            PictureLighting::b};
  std::string reference_name = "reference";
  std::string result_name = "result";
};

/// One picture, ready for a file: per lighting a row of reference, result, and their difference in
/// false colour with its mean and scale. Both are exposed as the reference asks.
/// Throws std::invalid_argument for a size out of range or no lighting.
Image comparison_sheet(const brdf::BrdfModel& reference, const brdf::BrdfModel& result,
                       brdf::RadiometricScale scale, const SheetOptions& options = {});

/// The same for one model alone: one sphere per lighting, in a row.
Image sphere_sheet(const brdf::BrdfModel& model, brdf::RadiometricScale scale,
                   const SheetOptions& options = {});

}  // namespace gonio::render
