#include "gonio/modbus_stage/drive_profile.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>

#include "drive_codec.h"

namespace gonio::modbus_stage {
namespace {

/// The checks of one profile, for messages that name it.
class ProfileChecks {
 public:
  explicit ProfileChecks(const DriveProfile& profile) : profile_(profile) {}

  [[noreturn]] void refuse(const std::string& field, const std::string& found,
                           const std::string& expected) const {
    throw std::invalid_argument(fmt::format("drive profile {}: {}: found {}, expected {}",
                                            profile_.name, field, found, expected));
  }

  void positive(const char* field, double value) const {
    if (!(value > 0.0 && std::isfinite(value))) {
      refuse(field, fmt::format("{:g}", value), "above 0");
    }
  }

  void registers() const {
    std::set<std::string> names;
    for (const Register& each : profile_.registers) {
      const std::string field = fmt::format("register \"{}\"", each.name);
      if (each.name.empty()) refuse("register: name", "none", "a name");
      if (!names.insert(each.name).second) refuse(field, "it twice", "different names");
      if (each.words < 1 || each.words > static_cast<int>(modbus_bus::kMaxWrittenRegisters) ||
          each.address + each.words > 0x10000) {
        refuse(field + ": words", std::to_string(each.words),
               fmt::format("1 to {} within 16 bits of address", modbus_bus::kMaxWrittenRegisters));
      }
      positive((field + ": scale").c_str(), each.scale);
    }
  }

  /// A register that holds one number.
  void number(const char* field, const std::string& name, bool needed) const {
    if (name.empty()) {
      if (needed) refuse(field, "none", "a register");
      return;
    }
    const Register* const found = profile_.find(name);
    if (found == nullptr) refuse(field, fmt::format("\"{}\"", name), "the name of a register");
    if (found->words > 2) {
      refuse(field, fmt::format("\"{}\" of {} words", name, found->words), "1 or 2 words");
    }
  }

  void bit(const char* field, const StatusBit& bit, const std::string& register_name) const {
    if (!bit.exists()) return;
    const Register* const of = profile_.find(register_name);
    if (of == nullptr) refuse(field, "a bit", "a register that it is of");
    if (bit.bit < 0 || bit.bit >= 16 * of->words) {
      refuse(field, std::to_string(bit.bit), fmt::format("0 to {}", 16 * of->words - 1));
    }
  }

  void command(const char* field, const Command& command, bool needed, bool moves) const {
    if (needed && command.empty()) refuse(field, "nothing", "at least one write");
    for (std::size_t i = 0; i < command.size(); ++i) {
      const RegisterWrite& write = command[i];
      const std::string place = fmt::format("{}[{}]", field, i);
      const Register* const to = profile_.find(write.register_name);
      if (to == nullptr) {
        refuse(place + ": register", fmt::format("\"{}\"", write.register_name),
               "the name of a register");
      }
      if (to->space != Register::Space::holding) {
        refuse(place + ": register", fmt::format("\"{}\", an input register", to->name),
               "a holding register");
      }
      if (write.words.empty() || write.words.size() > static_cast<std::size_t>(to->words)) {
        refuse(place + ": words", fmt::format("{} of them", write.words.size()),
               fmt::format("1 to {}, the words of \"{}\"", to->words, to->name));
      }
      for (const std::string& text : write.words) {
        const auto word = word_from_text(text);
        if (!word || (!moves && word->source != Word::Source::constant)) {
          refuse(place + ": words", fmt::format("\"{}\"", text),
                 moves ? "a number of 16 bits, or target, speed, acceleration or deceleration, "
                         "whole or .high or .low"
                       : "a number of 16 bits");
        }
      }
    }
  }

  /// A move that does not say where to is none.
  void target() const {
    const bool has_target =
        std::any_of(profile_.move.begin(), profile_.move.end(), [](const RegisterWrite& write) {
          return std::any_of(write.words.begin(), write.words.end(), [](const std::string& text) {
            const auto word = word_from_text(text);
            return word && word->source == Word::Source::target;
          });
        });
    if (!has_target) refuse("move", "no target in it", "target, or target.high and target.low");
  }

 private:
  const DriveProfile& profile_;
};

}  // namespace

const Register* DriveProfile::find(const std::string& register_name) const {
  const auto found = std::find_if(registers.begin(), registers.end(),
                                  [&](const Register& each) { return each.name == register_name; });
  return found == registers.end() ? nullptr : &*found;
}

void DriveProfile::validate() const {
  const ProfileChecks checks(*this);
  if (name.empty()) checks.refuse("name", "none", "a name");
  checks.registers();
  checks.positive("units.steps_per_rev", steps_per_rev);
  checks.positive("units.speed_scale", speed_scale);
  checks.positive("units.acceleration_scale", acceleration_scale);

  checks.number("status.register", status_register, true);
  checks.number("position.register", position_register, true);
  checks.number("alarm.register", alarm_register, false);
  checks.number("limits.register", limit_register, false);
  checks.number("following_error.register", following_error_register, false);
  if (!following_error_register.empty()) {
    checks.positive("following_error.max", max_following_error);
  }

  checks.bit("status.fault", fault, status_register);
  checks.bit("status.enabled", enabled, status_register);
  checks.bit("status.moving", moving, status_register);
  checks.bit("status.command_complete", command_complete, status_register);
  checks.bit("status.in_position", in_position, status_register);
  checks.bit("status.homed", homed, status_register);
  checks.bit("limits.forward", limit_forward, limit_register);
  checks.bit("limits.reverse", limit_reverse, limit_register);
  if (!moving.exists()) checks.refuse("status.moving", "none", "a bit");
  if (!command_complete.exists() && !in_position.exists()) {
    checks.refuse("status.in_position", "none", "a bit, here or as command_complete");
  }

  checks.command("enable", enable, false, false);
  checks.command("move", move, true, true);
  checks.target();
  checks.command("home", home, true, false);
  checks.command("stop", stop, true, false);
  checks.command("release", release, false, false);
  checks.command("reset_alarm", reset_alarm, false, false);

  for (const Expected& each : expected)
    checks.number("expected.register", each.register_name, true);
  if (start_time.count() < 0 || start_time > std::chrono::seconds(10)) {
    checks.refuse("start_time_ms", std::to_string(start_time.count()), "0 to 10000");
  }
}

}  // namespace gonio::modbus_stage
