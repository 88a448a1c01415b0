#pragma once

#include <string_view>

#include "gonio/render/image.h"

namespace gonio::render {

/// Draws a line of capitals, digits and a little punctuation as smooth strokes, enough to label a
/// picture without a font library. `x`, `baseline` and `height` in pixels.
void draw_text(Image& image, double x, double baseline, double height, std::string_view text,
               Rgba8 colour);

/// How far it will reach.
double text_width(double height, std::string_view text);

}  // namespace gonio::render
