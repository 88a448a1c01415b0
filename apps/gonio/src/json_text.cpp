#include "json_text.h"

#include <fmt/format.h>

namespace gonio::cli {

std::string json_text(const nlohmann::ordered_json& value) {
  const std::string dumped = value.dump(2, ' ', false, nlohmann::json::error_handler_t::replace);
  std::string text;
  text.reserve(dumped.size() + 1);
  // What is left after dump() stands inside of strings: DEL, and C1 as C2 80 to C2 9F in UTF-8.
  for (std::size_t i = 0; i < dumped.size(); ++i) {
    const auto byte = static_cast<unsigned char>(dumped[i]);
    const auto next = static_cast<unsigned char>(i + 1 < dumped.size() ? dumped[i + 1] : 0);
    if (byte == 0x7FU) {
      text += "\\u007f";
    } else if (byte == 0xC2U && next < 0xA0U) {
      text += fmt::format("\\u{:04x}", next);
      ++i;
    } else {
      text += dumped[i];
    }
  }
  return text + "\n";
}

}  // namespace gonio::cli
