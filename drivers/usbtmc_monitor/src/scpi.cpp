#include "gonio/usbtmc_monitor/scpi.h"

#include <charconv>
#include <cmath>
#include <system_error>

namespace gonio::usbtmc_monitor {
namespace {

constexpr double kScpiInfinity = 9.9e37;
constexpr std::size_t kShown = 60;

std::string_view without_line_end(std::string_view text) {
  if (text.ends_with('\n')) text.remove_suffix(1);
  if (text.ends_with('\r')) text.remove_suffix(1);
  return text;
}

bool is_digit(char letter) { return letter >= '0' && letter <= '9'; }

}  // namespace

std::optional<double> scpi_number(std::string_view text) {
  text = without_line_end(text);
  // from_chars() takes a minus but no plus, and words such as "inf", which begin with a letter.
  std::string_view magnitude = text;
  const bool has_sign = text.starts_with('+') || text.starts_with('-');
  if (has_sign) magnitude.remove_prefix(1);
  if (magnitude.empty() || !(is_digit(magnitude.front()) || magnitude.front() == '.')) {
    return std::nullopt;
  }
  double value = 0.0;
  const char* const last = magnitude.data() + magnitude.size();
  const auto [end, error] = std::from_chars(magnitude.data(), last, value);
  if (error != std::errc() || end != last || !std::isfinite(value)) return std::nullopt;
  return text.front() == '-' ? -value : value;
}

bool is_out_of_range(double value) { return std::abs(value) >= kScpiInfinity; }

std::optional<ScpiError> scpi_error(std::string_view text) {
  text = without_line_end(text);
  const std::size_t comma = text.find(',');
  if (comma == std::string_view::npos) return std::nullopt;
  std::string_view code = text.substr(0, comma);
  if (code.starts_with('+')) code.remove_prefix(1);
  ScpiError found;
  const char* const last = code.data() + code.size();
  const auto [end, error] = std::from_chars(code.data(), last, found.code);
  if (code.empty() || error != std::errc() || end != last) return std::nullopt;
  std::string_view message = text.substr(comma + 1);
  if (message.size() < 2 || !message.starts_with('"') || !message.ends_with('"')) {
    return std::nullopt;
  }
  found.message = printable(message.substr(1, message.size() - 2));
  return found;
}

std::string printable(std::string_view text) {
  std::string shown;
  for (const char letter : without_line_end(text).substr(0, kShown)) {
    shown.push_back(letter >= ' ' && letter <= '~' ? letter : '?');
  }
  return shown;
}

}  // namespace gonio::usbtmc_monitor
