#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace gonio::json {

/// Parses a file of ours, checks its keys "format" and "version" and takes them out. Throws
/// DataFormatError: not JSON, nested deeper than files of ours are, numbers out of range, another
/// format or version.
nlohmann::json parse_document(const std::string& text, const std::filesystem::path& place,
                              std::string_view format, int version);

}  // namespace gonio::json
