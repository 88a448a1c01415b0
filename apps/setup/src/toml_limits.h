#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>

namespace gonio::cli {

/// Far above any rig file, far below the memory.
constexpr std::size_t kMaxTomlBytes = std::size_t{1} << 20U;

/// Refuses TOML text of more than kMaxTomlBytes, or whose tables and arrays are nested so deep that
/// a parser, which follows them by recursion, would run out of stack: keys of more than 16 dotted
/// parts, brackets more than 16 deep. Of TOML it knows only where strings and comments begin and
/// end; everything else that is wrong is left to the parser.
///
/// Cost     One pass over the bytes.
/// Errors   ConfigError (`file`, line). `file` only names the text.
void require_parsable(std::string_view text, const std::filesystem::path& file);

}  // namespace gonio::cli
