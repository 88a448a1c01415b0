#include "drive_codec.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <stdexcept>

namespace gonio::modbus_stage {
namespace {

constexpr double kLargestNumber = 2147483647.0;

std::optional<Word> constant_from_text(std::string_view text) {
  const bool negative = text.starts_with('-');
  if (negative) text.remove_prefix(1);
  const bool hex = text.starts_with("0x");
  if (hex) text.remove_prefix(2);
  std::uint32_t value = 0;
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value, hex ? 16 : 10);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  if (value > (negative ? 0x8000U : 0xFFFFU)) return std::nullopt;
  const auto word = static_cast<std::uint16_t>(value);
  return Word{Word::Source::constant, Word::Part::whole,
              static_cast<std::uint16_t>(negative ? 0U - word : word)};
}

std::int64_t number_of(Word::Source source, const MoveNumbers& numbers) {
  switch (source) {
    case Word::Source::target:
      return numbers.target;
    case Word::Source::speed:
      return numbers.speed;
    case Word::Source::acceleration:
      return numbers.acceleration;
    case Word::Source::deceleration:
      return numbers.deceleration;
    case Word::Source::constant:
      break;
  }
  return 0;
}

std::uint16_t value_of(const Word& word, const std::string& text, const MoveNumbers& numbers) {
  if (word.source == Word::Source::constant) return word.constant;
  const std::int64_t number = number_of(word.source, numbers);
  const auto bits = static_cast<std::uint32_t>(number);
  if (word.part == Word::Part::high) return static_cast<std::uint16_t>(bits >> 16U);
  if (word.part == Word::Part::low) return static_cast<std::uint16_t>(bits & 0xFFFFU);
  if (number < -32768 || number > 65535) {
    throw std::invalid_argument(
        fmt::format("{}: found {}, expected what fits 16 bits", text, number));
  }
  return static_cast<std::uint16_t>(bits & 0xFFFFU);
}

/// Rounded down, never to nothing.
std::int64_t usable(double number, const char* what) {
  const double rounded = std::floor(number + 1e-9);
  if (!(rounded >= 1.0 && rounded <= kLargestNumber)) {
    throw std::invalid_argument(fmt::format(
        "{}: found {:g} in units of the drive, expected 1 to {:g}", what, number, kLargestNumber));
  }
  return static_cast<std::int64_t>(rounded);
}

}  // namespace

std::optional<Word> word_from_text(std::string_view text) {
  Word word;
  const std::size_t dot = text.find('.');
  const std::string_view name = text.substr(0, dot);
  if (name == "target") {
    word.source = Word::Source::target;
  } else if (name == "speed") {
    word.source = Word::Source::speed;
  } else if (name == "acceleration") {
    word.source = Word::Source::acceleration;
  } else if (name == "deceleration") {
    word.source = Word::Source::deceleration;
  } else {
    return constant_from_text(text);
  }
  if (dot == std::string_view::npos) return word;
  const std::string_view part = text.substr(dot + 1);
  if (part != "high" && part != "low") return std::nullopt;
  word.part = part == "high" ? Word::Part::high : Word::Part::low;
  return word;
}

modbus_bus::Request read_request(const Register& from) {
  const auto words = static_cast<std::size_t>(from.words);
  return from.space == Register::Space::holding
             ? modbus_bus::read_holding_registers(from.address, words)
             : modbus_bus::read_input_registers(from.address, words);
}

std::int64_t number_from_words(const Register& from, std::span<const std::uint16_t> words) {
  if (from.words == 1) {
    return from.is_signed ? std::int64_t{static_cast<std::int16_t>(words[0])}
                          : std::int64_t{words[0]};
  }
  const std::uint32_t high = words[from.low_word_first ? 1 : 0];
  const std::uint32_t low = words[from.low_word_first ? 0 : 1];
  const std::uint32_t bits = (high << 16U) | low;
  return from.is_signed ? std::int64_t{static_cast<std::int32_t>(bits)} : std::int64_t{bits};
}

std::vector<std::uint16_t> words_from_number(const Register& to, std::int64_t number) {
  const auto bits = static_cast<std::uint32_t>(number);
  const auto high = static_cast<std::uint16_t>(bits >> 16U);
  const auto low = static_cast<std::uint16_t>(bits & 0xFFFFU);
  if (to.words == 1) return {low};
  return to.low_word_first ? std::vector{low, high} : std::vector{high, low};
}

modbus_bus::Request write_request(const Register& to, const RegisterWrite& write,
                                  const MoveNumbers& numbers) {
  std::vector<std::uint16_t> words;
  for (const std::string& text : write.words) {
    const auto word = word_from_text(text);
    if (!word) throw std::invalid_argument(fmt::format("found \"{}\", expected a word", text));
    words.push_back(value_of(*word, text, numbers));
  }
  if (words.size() == 1 && !to.write_multiple) {
    return modbus_bus::write_register(to.address, words[0]);
  }
  return modbus_bus::write_registers(to.address, std::move(words));
}

std::int64_t speed_number(const DriveProfile& profile, double steps_per_deg, double deg_per_s) {
  double number = steps_per_deg * deg_per_s;
  if (profile.speed_unit == DriveProfile::SpeedUnit::rpm) number *= 60.0 / profile.steps_per_rev;
  return usable(number / profile.speed_scale, "max_speed_deg_per_s");
}

std::int64_t acceleration_number(const DriveProfile& profile, double steps_per_deg,
                                 double deg_per_s2) {
  const double steps_per_s2 = steps_per_deg * deg_per_s2;
  if (profile.acceleration_unit == DriveProfile::AccelerationUnit::steps_per_s2) {
    return usable(steps_per_s2 / profile.acceleration_scale, "acceleration_deg_per_s2");
  }
  const double rpm_per_s = steps_per_s2 * 60.0 / profile.steps_per_rev;
  const double ms_per_1000rpm = 1000.0 / rpm_per_s * 1000.0;
  // A time: rounded up it is the lower acceleration.
  return usable(std::ceil(ms_per_1000rpm / profile.acceleration_scale - 1e-9),
                "acceleration_deg_per_s2");
}

}  // namespace gonio::modbus_stage
