#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "gonio/acquisition/session_archive.h"
#include "gonio/errors/errors.h"
#include "journal.h"

namespace gonio::acquisition {

/// No time of a session is later, with all that its parts waited for each other: thirty years.
inline constexpr std::chrono::nanoseconds kLongestSession =
    kLatestPart + std::chrono::hours(24 * 365);

/// Reads the values of one row in order; anything that is no number becomes a DataFormatError.
class RowFields {
 public:
  RowFields(const std::filesystem::path& path, std::string_view table, const Journal::Row& row)
      : path_(path), table_(table), row_(row) {}

  const std::string& text() { return row_.values.at(next_++); }
  template <class Number>
  Number number() {
    return parse<Number>(text());
  }
  /// Of the session's clock, or an exposure: sums of a few stay within 64 bits.
  std::chrono::nanoseconds nanoseconds();
  /// Of a plan; `lowest` -1: or of none.
  int point(int lowest);
  std::vector<Angle> angles();
  /// So many whole numbers, none of them negative.
  std::vector<std::int64_t> counts(std::size_t size);
  template <class Enum>
  Enum name(std::initializer_list<Enum> known) {
    const std::string& word = text();
    for (const Enum value : known) {
      if (to_string(value) == word) return value;
    }
    fail(fmt::format("unknown word {:?}", word));
  }
  [[noreturn]] void fail(const std::string& why) const {
    throw DataFormatError(path_, fmt::format("{} row {}", table_, row_.number), why);
  }

 private:
  template <class Number>
  Number parse(const std::string& text) const {
    Number value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
      fail(fmt::format("found {:?}, expected a number", text));
    }
    if constexpr (std::is_floating_point_v<Number>) {
      if (!std::isfinite(value)) fail(fmt::format("found {:?}, expected a finite number", text));
    }
    return value;
  }

  /// Separated by blanks.
  template <class Number>
  std::vector<Number> numbers() {
    const std::string& all = text();
    std::vector<Number> result;
    std::size_t at = 0;
    while (at < all.size()) {
      const std::size_t end = std::min(all.find(' ', at), all.size());
      result.push_back(parse<Number>(all.substr(at, end - at)));
      at = end + 1;
    }
    return result;
  }

  const std::filesystem::path& path_;
  std::string_view table_;
  const Journal::Row& row_;
  std::size_t next_ = 0;
};

/// Size, format and levels of a frame, without its pixels; behind the fields of frame_record().
devices::Frame shape_of(RowFields& fields);
FrameRecord frame_record(RowFields& fields, std::int64_t number);
PointRecord point_record(RowFields& fields);

}  // namespace gonio::acquisition
