#include "gonio/console/printable.h"

#include <fmt/format.h>

namespace gonio::cli {
namespace {

unsigned char byte_at(std::string_view text, std::size_t i) {
  return i < text.size() ? static_cast<unsigned char>(text[i]) : 0;
}

bool continues(unsigned char byte) { return (byte & 0xC0U) == 0x80U; }

/// Bytes of the UTF-8 character at `i`; 0 when there is none. Table 3-7 of the Unicode standard:
/// the second byte's range rules out overlong forms, surrogates and what is above U+10FFFF.
std::size_t character_bytes(std::string_view text, std::size_t i) {
  const unsigned char first = byte_at(text, i);
  const unsigned char second = byte_at(text, i + 1);
  if (first < 0x80U) return 1;
  if (first < 0xC2U || first > 0xF4U || !continues(second)) return 0;
  if (first < 0xE0U) return 2;
  if (first == 0xE0U && second < 0xA0U) return 0;
  if (first == 0xEDU && second > 0x9FU) return 0;
  if (first == 0xF0U && second < 0x90U) return 0;
  if (first == 0xF4U && second > 0x8FU) return 0;
  if (!continues(byte_at(text, i + 2))) return 0;
  if (first < 0xF0U) return 3;
  return continues(byte_at(text, i + 3)) ? 4 : 0;
}

/// Bytes of the character at `i` if it may be shown, otherwise 0.
std::size_t shown_bytes(std::string_view text, std::size_t i) {
  const unsigned char first = byte_at(text, i);
  if ((first < 0x20U && first != '\t') || first == 0x7FU) return 0;
  if (first == 0xC2U && byte_at(text, i + 1) < 0xA0U) return 0;  // C1
  return character_bytes(text, i);
}

std::string printable(std::string_view text, bool keep_line_ends) {
  std::string shown;
  shown.reserve(text.size());
  for (std::size_t i = 0; i < text.size();) {
    if (const std::size_t count = shown_bytes(text, i)) {
      shown.append(text.substr(i, count));
      i += count;
      continue;
    }
    if (text[i] == '\n') {
      shown += keep_line_ends ? "\n" : "\\n";
    } else if (text[i] == '\r') {
      shown += "\\r";
    } else {
      shown += fmt::format("\\x{:02x}", byte_at(text, i));
    }
    ++i;
  }
  return shown;
}

}  // namespace

std::string printable_line(std::string_view text) { return printable(text, false); }
std::string printable_text(std::string_view text) { return printable(text, true); }

std::size_t find_unprintable(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t count = shown_bytes(text, i);
    if (count == 0) return i;
    i += count;
  }
  return std::string_view::npos;
}

}  // namespace gonio::cli
