#pragma once

#include <array>
#include <string_view>

namespace gonio::page {

/// The page's style sheet: light and dark, 1280 px down to a phone, and paper.
std::string_view style_sheet();

/// Its classes of the three colour channels.
inline constexpr std::array<std::string_view, 3> kChannelClasses = {"r", "g", "b"};

}  // namespace gonio::page
