#pragma once

#include <span>
#include <vector>

#include "gonio/brdf/brdf_model.h"
#include "gonio/render/sphere_picture.h"
#include "sphere_layout.h"

namespace gonio::render {

/// Adds the studio's light to one picture per model.
void render_studio(std::span<const brdf::BrdfModel* const> models, const SphereLayout& layout,
                   std::vector<SpherePicture>& pictures);

}  // namespace gonio::render
