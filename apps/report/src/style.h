#pragma once

#include <string_view>

namespace gonio::report {

/// The page's style sheet: light and dark, 1280 px down to a phone, and paper.
std::string_view style_sheet();

}  // namespace gonio::report
