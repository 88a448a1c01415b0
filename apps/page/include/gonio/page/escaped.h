#pragma once

#include <string>
#include <string_view>

namespace gonio::page {

/// Text made safe for element content and quoted attributes of HTML and XML: & < > " ' as entities,
/// control characters and bytes that are not UTF-8 as U+FFFD.
std::string escaped(std::string_view text);

}  // namespace gonio::page
