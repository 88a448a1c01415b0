#pragma once

#include <string>
#include <string_view>

namespace gonio::cli {

/// Text as it may be shown on a terminal. Names of materials, samples and files come from people,
/// archives and other programs; an escape sequence in one must not act.
///
/// Control characters (C0 without the tab, DEL, and C1 in UTF-8) and bytes that are no UTF-8 become
/// "\x1b"; a line end "\n", a carriage return "\r". Everything else stays.
std::string printable_line(std::string_view text);

/// The same for text of several lines, whose line ends stay.
std::string printable_text(std::string_view text);

/// Where the first such character stands, in bytes from 0; npos when there is none.
std::size_t find_unprintable(std::string_view text);

}  // namespace gonio::cli
