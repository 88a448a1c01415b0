#include "gonio/setup/drive_profile_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "config_reader.h"
#include "gonio/console/suggest.h"
#include "gonio/errors/errors.h"
#include "gonio/files/text_file.h"
#include "gonio/shipped_drives/shipped_drives.h"
#include "toml_limits.h"

namespace gonio::cli {
namespace {

using modbus_stage::Command;
using modbus_stage::DriveProfile;
using modbus_stage::Register;
using modbus_stage::RegisterWrite;
using modbus_stage::StatusBit;

constexpr double kMilliseconds = 1e-3;
constexpr Range kAddress{0, 65535};
constexpr Range kScale{1e-12, 1e12};
constexpr Range kNumber32{-2147483648.0, 2147483647.0};

void visit_register(ConfigVisitor& v, Register& each) {
  v.text("name", each.name, "");
  int address = each.address;
  v.integer("address", address, kAddress, "");
  each.address = static_cast<std::uint16_t>(address);
  v.enumeration("space", each.space, {"holding", "input"}, "");
  v.integer("words", each.words, {1, 123}, "");
  v.flag("low_word_first", each.low_word_first, "");
  v.flag("signed", each.is_signed, "");
  v.number("scale", each.scale, kScale, "");
  v.flag("write_multiple", each.write_multiple, "");
  v.flag("confirmed", each.confirmed, "");
}

void visit_bit(ConfigVisitor& v, const char* key, StatusBit& bit) {
  v.integer(key, bit.bit, {StatusBit::kNone, 31}, "");
}

/// Returns the names in `inverted` that are none of the bits.
std::string visit_status(ConfigVisitor& v, DriveProfile& profile) {
  v.text("register", profile.status_register, "");
  const std::array<std::pair<const char*, StatusBit*>, 6> bits{
      {{"fault", &profile.fault},
       {"enabled", &profile.enabled},
       {"moving", &profile.moving},
       {"command_complete", &profile.command_complete},
       {"in_position", &profile.in_position},
       {"homed", &profile.homed}}};
  for (const auto& [key, bit] : bits) visit_bit(v, key, *bit);
  std::vector<std::string> inverted;
  v.texts("inverted", inverted, "");
  std::string unknown;
  for (const std::string& name : inverted) {
    const auto* const found =
        std::find_if(bits.begin(), bits.end(), [&](const auto& bit) { return name == bit.first; });
    if (found == bits.end()) {
      unknown = name;
    } else {
      found->second->inverted = true;
    }
  }
  return unknown;
}

void visit_command(ConfigVisitor& v, const std::string& name, Command& command) {
  v.array(
      name, "", command.size(), [&](std::size_t count) { command.assign(count, {}); },
      [&](std::size_t i) {
        RegisterWrite& write = command[i];
        v.text("register", write.register_name, "");
        v.texts("words", write.words, "");
        v.flag("repeatable", write.repeatable, "");
      });
}

/// Of a register with a 32-bit number beside it.
void visit_number(ConfigVisitor& v, const char* key, std::int64_t& value) {
  int number = static_cast<int>(value);
  v.integer(key, number, kNumber32, "");
  value = number;
}

std::string visit_profile(ConfigVisitor& v, DriveProfile& profile) {
  std::string unknown_bit;
  v.text("name", profile.name, "");
  v.duration("start_time_ms", profile.start_time, kMilliseconds, {0.0, 10000.0}, "");
  v.flag("absolute_encoder", profile.absolute_encoder, "");
  v.table("units", "", [&] {
    v.integer("steps_per_rev", profile.steps_per_rev, {1, 100000000}, "");
    v.enumeration("speed", profile.speed_unit, {"steps_per_s", "rpm"}, "");
    v.number("speed_scale", profile.speed_scale, kScale, "");
    v.enumeration("acceleration", profile.acceleration_unit, {"steps_per_s2", "ms_per_1000rpm"},
                  "");
    v.number("acceleration_scale", profile.acceleration_scale, kScale, "");
  });
  v.array(
      "register", "", profile.registers.size(),
      [&](std::size_t count) { profile.registers.assign(count, {}); },
      [&](std::size_t i) { visit_register(v, profile.registers[i]); });
  v.table("status", "", [&] { unknown_bit = visit_status(v, profile); });
  v.table("position", "", [&] { v.text("register", profile.position_register, ""); });
  v.table("alarm", "", [&] {
    v.text("register", profile.alarm_register, "");
    v.array(
        "text", "", profile.alarm_texts.size(),
        [&](std::size_t count) { profile.alarm_texts.assign(count, {}); },
        [&](std::size_t i) {
          visit_number(v, "code", profile.alarm_texts[i].code);
          v.text("text", profile.alarm_texts[i].text, "");
        });
  });
  v.table("limits", "", [&] {
    v.text("register", profile.limit_register, "");
    visit_bit(v, "forward", profile.limit_forward);
    visit_bit(v, "reverse", profile.limit_reverse);
  });
  v.table("following_error", "", [&] {
    v.text("register", profile.following_error_register, "");
    v.number("max", profile.max_following_error, kScale, "");
  });
  visit_command(v, "enable", profile.enable);
  visit_command(v, "move", profile.move);
  visit_command(v, "home", profile.home);
  visit_command(v, "stop", profile.stop);
  visit_command(v, "release", profile.release);
  visit_command(v, "reset_alarm", profile.reset_alarm);
  v.array(
      "expect", "", profile.expected.size(),
      [&](std::size_t count) { profile.expected.assign(count, {}); },
      [&](std::size_t i) {
        v.text("register", profile.expected[i].register_name, "");
        visit_number(v, "value", profile.expected[i].value);
      });
  return unknown_bit;
}

}  // namespace

DriveProfile drive_profile_from_text(const std::string& text, const std::filesystem::path& place) {
  ConfigReader reader(text, place);
  DriveProfile profile;
  const std::string unknown_bit = visit_profile(reader, profile);
  reader.finish();
  if (!unknown_bit.empty()) {
    throw ConfigError(place, reader.line_of("status.inverted"), "status.inverted",
                      fmt::format("found \"{}\", expected names of bits in [status]", unknown_bit));
  }
  try {
    profile.validate();
  } catch (const std::invalid_argument& error) {
    throw ConfigError(place, 0, "profile", error.what());
  }
  return profile;
}

DriveProfile read_drive_profile(const std::filesystem::path& path) {
  return drive_profile_from_text(files::read_text_file(path, kMaxTomlBytes), path);
}

DriveProfile shipped_drive_profile(const std::string& name) {
  for (const auto& each : shipped_drives::shipped_drives()) {
    if (each.name == name) {
      return drive_profile_from_text(std::string(each.toml), name + ".toml");
    }
  }
  const std::vector<std::string> names = shipped_drive_names();
  throw std::invalid_argument(fmt::format("profile: found \"{}\", expected one of {}{}", name,
                                          fmt::join(names, ", "), did_you_mean(name, names)));
}

DriveProfile drive_profile(const std::string& word, const std::filesystem::path& folder) {
  if (word.ends_with(".toml")) return read_drive_profile(folder / word);
  return shipped_drive_profile(word);
}

std::vector<std::string> shipped_drive_names() {
  std::vector<std::string> names;
  for (const auto& each : shipped_drives::shipped_drives()) names.emplace_back(each.name);
  return names;
}

}  // namespace gonio::cli
