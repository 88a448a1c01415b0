#include "toml_limits.h"

#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "gonio/errors/errors.h"

namespace gonio::cli {
namespace {

// A rig file needs three of each.
constexpr int kMaxParts = 16;
constexpr int kMaxDepth = 16;

/// The end of the string that begins at `begin`. A string that its line leaves open ends with the
/// line: the parser refuses it there.
std::size_t end_of_string(std::string_view text, std::size_t begin) {
  const char quote = text[begin];
  const std::string_view three = quote == '"' ? "\"\"\"" : "'''";
  const bool lines = text.substr(begin, 3) == three;
  std::size_t i = begin + (lines ? 3 : 1);
  for (; i < text.size(); ++i) {
    if (text[i] == '\\' && quote == '"') {
      ++i;
    } else if (lines && text.substr(i, 3) == three) {
      i += 3;
      // Up to two further quotes belong to the contents and stand before the last three.
      for (int more = 0; more < 2 && i < text.size() && text[i] == quote; ++more) ++i;
      return i;
    } else if (!lines && (text[i] == quote || text[i] == '\n')) {
      return text[i] == quote ? i + 1 : i;
    }
  }
  return text.size();
}

}  // namespace

void require_parsable(std::string_view text, const std::filesystem::path& file) {
  int line = 1;
  int depth = 0;
  int parts = 1;
  const auto refuse = [&](const std::string& why) { throw ConfigError(file, line, "TOML", why); };
  if (text.size() > kMaxTomlBytes) {
    refuse(fmt::format("found {} bytes, expected at most {}", text.size(), kMaxTomlBytes));
  }
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t begin = i;
    switch (text[i]) {
      case '"':
      case '\'':
        i = end_of_string(text, i);
        break;
      case '#':
        i = std::min(text.find('\n', i), text.size());
        break;
      default:
        ++i;
        if (text[begin] == '[' || text[begin] == '{') ++depth;
        if (text[begin] == ']' || text[begin] == '}') --depth;
        parts = text[begin] == '.' ? parts + 1 : parts;
        // What ends a key, or a number, whose dot is counted as well.
        if (std::string_view("\n=,[]{}").find(text[begin]) != std::string_view::npos) parts = 1;
    }
    if (parts > kMaxParts) {
      refuse(fmt::format("found a key of more than {0} parts, expected at most {0}", kMaxParts));
    }
    if (depth > kMaxDepth) {
      refuse(fmt::format("found brackets more than {0} deep, expected at most {0}", kMaxDepth));
    }
    for (std::size_t at = begin; at < i; ++at) line += text[at] == '\n' ? 1 : 0;
  }
}

}  // namespace gonio::cli
