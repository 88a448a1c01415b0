#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

#include "gonio/page/escaped.h"
#include "gonio/render/image.h"

namespace gonio::page {

std::string base64(std::span<const std::byte> bytes);

/// `<img>` with the picture inside. `alt` is escaped here.
std::string embedded_picture(const render::Image& image, std::string_view alt);

/// 1096216 as 1,096,216.
std::string grouped(std::size_t count);

/// 12.3 s, 4 min 05 s, 1 h 20 min.
std::string duration(double seconds);

/// About three significant digits, without an exponent where that stays readable; "–" for NaN.
std::string number(double value);

}  // namespace gonio::page
