#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

namespace gonio::modbus_stage {

/// One quantity of a drive.
struct Register {
  enum class Space { holding, input };  ///< read by function 03 or 04

  std::string name;           ///< by which the rest of a profile, and `confirmed`, speaks of it
  std::uint16_t address = 0;  ///< of its first word
  Space space = Space::holding;
  int words = 1;  ///< 1 or 2 of a number; a block that is only written has up to 123
  bool low_word_first = false;
  bool is_signed = false;
  double scale = 1.0;           ///< value = scale * number
  bool write_multiple = false;  ///< one word too is written by function 10
  bool confirmed = true;        ///< false: no page of a manual that says so was found
};

/// One write of a command. `words` in the order of the addresses, each a number ("0x10", "-4") or
/// target, speed, acceleration or deceleration, whole or one half of it: "target.high",
/// "target.low".
struct RegisterWrite {
  std::string register_name;
  std::vector<std::string> words;
  bool repeatable = true;  ///< may be sent again when its answer was lost
};
using Command = std::vector<RegisterWrite>;

/// A bit of the register it belongs to; none where a drive has no such bit.
struct StatusBit {
  static constexpr int kNone = -1;
  int bit = kNone;
  bool inverted = false;  ///< 0 means that it is so

  bool exists() const { return bit != kNone; }
  bool in(std::uint32_t value) const {
    return exists() && (((value >> bit) & 1U) != 0) != inverted;
  }
};

/// All that ModbusStage has to know about a family of drives. Data, so that a drive is added
/// without compiling; apps read it from TOML (docs/formats.md).
struct DriveProfile {
  enum class SpeedUnit { steps_per_s, rpm };
  enum class AccelerationUnit { steps_per_s2, ms_per_1000rpm };
  struct Expected {
    std::string register_name;
    std::int64_t value = 0;
  };
  struct AlarmText {
    std::int64_t code = 0;
    std::string text;
  };

  std::string name;
  std::vector<Register> registers;

  // Units of the numbers in a command.
  int steps_per_rev = 10000;  ///< of the motor; only for units by revolutions
  SpeedUnit speed_unit = SpeedUnit::steps_per_s;
  AccelerationUnit acceleration_unit = AccelerationUnit::steps_per_s2;
  double speed_scale = 1.0;  ///< value = scale * number, as for a register
  double acceleration_scale = 1.0;

  // Names of registers.
  std::string status_register;
  std::string position_register;         ///< feedback, in steps of a command's target
  std::string alarm_register;            ///< "": none
  std::string limit_register;            ///< "": none
  std::string following_error_register;  ///< "": none
  double max_following_error = 0.0;      ///< in its unit

  // Bits of the status register. `moving` is needed, and one of the two after it.
  StatusBit fault;
  StatusBit enabled;
  StatusBit moving;
  StatusBit command_complete;
  StatusBit in_position;
  StatusBit homed;
  // Bits of the limit register.
  StatusBit limit_forward;
  StatusBit limit_reverse;

  Command enable;
  Command move;  ///< to an absolute position
  Command home;
  Command stop;
  Command release;  ///< of a stop that is a level; "": none
  Command reset_alarm;

  std::vector<Expected> expected;  ///< settings of the drive that this profile counts on
  std::vector<AlarmText> alarm_texts;
  /// How long after a command the status may still be that of before.
  std::chrono::milliseconds start_time{50};
  /// An encoder that knows its position after a power failure.
  bool absolute_encoder = false;

  /// Throws std::invalid_argument "drive profile NAME: FIELD: found ..., expected ...".
  void validate() const;

  /// nullptr when there is none.
  const Register* find(const std::string& register_name) const;
};

}  // namespace gonio::modbus_stage
