#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace gonio::cli {

/// Indented, with a line end: for people and pipes. Bytes that are no UTF-8, as file names may
/// hold, are replaced, so that the text is always valid JSON. All control characters are escaped,
/// also those that JSON would allow: the text may go to a terminal.
std::string json_text(const nlohmann::ordered_json& value);

/// The same on one line, for files that keep it inside of them.
inline std::string json_line(const nlohmann::ordered_json& value) {
  return value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

}  // namespace gonio::cli
