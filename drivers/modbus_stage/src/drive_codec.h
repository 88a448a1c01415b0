#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/modbus_bus/request.h"
#include "gonio/modbus_stage/drive_profile.h"

/// Between a drive's registers and numbers. Pure functions.
namespace gonio::modbus_stage {

/// The numbers of one move, in the drive's own units.
struct MoveNumbers {
  std::int32_t target = 0;
  std::int64_t speed = 0;
  std::int64_t acceleration = 0;
  std::int64_t deceleration = 0;
};

/// One word of a RegisterWrite.
struct Word {
  enum class Source { constant, target, speed, acceleration, deceleration };
  enum class Part { whole, high, low };
  Source source = Source::constant;
  Part part = Part::whole;
  std::uint16_t constant = 0;
};
/// None where the text is no word.
std::optional<Word> word_from_text(std::string_view text);

/// Which request reads `from`.
modbus_bus::Request read_request(const Register& from);
/// Its number, unscaled. `words` as many as it has.
std::int64_t number_from_words(const Register& from, std::span<const std::uint16_t> words);
std::vector<std::uint16_t> words_from_number(const Register& to, std::int64_t number);

/// Which request writes `write` to `to`. Throws std::invalid_argument for a whole number that does
/// not fit a word.
modbus_bus::Request write_request(const Register& to, const RegisterWrite& write,
                                  const MoveNumbers& numbers);

/// Speed and acceleration of a joint of `steps_per_deg` in the profile's units, rounded so that
/// neither is exceeded. Throws std::invalid_argument where that leaves nothing.
std::int64_t speed_number(const DriveProfile& profile, double steps_per_deg, double deg_per_s);
std::int64_t acceleration_number(const DriveProfile& profile, double steps_per_deg,
                                 double deg_per_s2);

}  // namespace gonio::modbus_stage
