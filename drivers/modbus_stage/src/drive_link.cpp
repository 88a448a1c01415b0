#include "drive_link.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "gonio/modbus_stage/stop_drive.h"

namespace gonio::modbus_stage {

using devices::DeviceErrc;
using devices::DeviceError;

DriveLink::DriveLink(std::shared_ptr<modbus_bus::ModbusBus> bus, modbus_bus::Station station,
                     DriveProfile profile, const std::vector<std::string>& confirmed,
                     OnError on_error)
    : bus_(std::move(bus)),
      station_(std::move(station)),
      profile_(std::move(profile)),
      on_error_(std::move(on_error)) {
  profile_.validate();
  leave_out_unconfirmed(confirmed);
}

void DriveLink::leave_out_unconfirmed(const std::vector<std::string>& confirmed) {
  for (const std::string& name : confirmed) {
    if (profile_.find(name) == nullptr) {
      throw std::invalid_argument(
          fmt::format("axis {}: confirmed: found \"{}\", expected a register of the profile {}",
                      station_.device, name, profile_.name));
    }
  }
  const auto unconfirmed = [&](const std::string& name) {
    const Register* const found = profile_.find(name);
    return found != nullptr && !found->confirmed &&
           std::find(confirmed.begin(), confirmed.end(), name) == confirmed.end();
  };
  // Motion does not depend on these; without them messages say less.
  for (std::string* name :
       {&profile_.alarm_register, &profile_.limit_register, &profile_.following_error_register}) {
    if (unconfirmed(*name)) name->clear();
  }
  const auto require = [&](const std::string& name) {
    if (!unconfirmed(name)) return;
    throw std::invalid_argument(
        fmt::format("axis {}: register \"{}\" (0x{:04X}) of the profile {} is not confirmed by a "
                    "manual; try it "
                    "on the drive, then set confirmed = [\"{}\"]",
                    station_.device, name, profile_.find(name)->address, profile_.name, name));
  };
  require(profile_.status_register);
  require(profile_.position_register);
  for (const Command* command : {&profile_.enable, &profile_.move, &profile_.home, &profile_.stop,
                                 &profile_.release, &profile_.reset_alarm}) {
    for (const RegisterWrite& write : *command) require(write.register_name);
  }
  for (const DriveProfile::Expected& each : profile_.expected) require(each.register_name);
}

void DriveLink::require_encodable(const Command& command, const MoveNumbers& numbers) const {
  for (const RegisterWrite& write : command) {
    write_request(*profile_.find(write.register_name), write, numbers);
  }
}

void DriveLink::require_expected_settings() {
  for (const DriveProfile::Expected& each : profile_.expected) {
    const std::int64_t found = read(each.register_name);
    if (found == each.value) continue;
    throw DeviceError(
        DeviceErrc::Protocol, station_.device,
        fmt::format("{}: found {}, the profile {} expects {}: change the setting or the profile",
                    each.register_name, found, profile_.name, each.value));
  }
}

DriveState DriveLink::state(bool with_steps_of_moving) {
  const auto status = static_cast<std::uint32_t>(read(profile_.status_register));
  DriveState state;
  state.fault = profile_.fault.in(status);
  state.enabled = !profile_.enabled.exists() || profile_.enabled.in(status);
  state.moving = profile_.moving.in(status);
  state.arrived = (!profile_.command_complete.exists() || profile_.command_complete.in(status)) &&
                  (!profile_.in_position.exists() || profile_.in_position.in(status));
  state.homed = !profile_.homed.exists() || profile_.homed.in(status);
  if (with_steps_of_moving || !state.moving) state.steps = steps();
  return state;
}

std::int64_t DriveLink::steps() {
  const double scale = profile_.find(profile_.position_register)->scale;
  return std::llround(scale * static_cast<double>(read(profile_.position_register)));
}

std::string DriveLink::alarm_text() {
  if (profile_.alarm_register.empty()) return "the drive reports an alarm; see its display";
  const std::int64_t code = read(profile_.alarm_register);
  const auto known = std::find_if(profile_.alarm_texts.begin(), profile_.alarm_texts.end(),
                                  [&](const auto& each) { return each.code == code; });
  return fmt::format("the drive's alarm 0x{:02X}: {}", code,
                     known == profile_.alarm_texts.end() ? "see its manual" : known->text);
}

std::string DriveLink::limit_text() {
  if (profile_.limit_register.empty()) return "";
  const auto bits = static_cast<std::uint32_t>(read(profile_.limit_register));
  if (profile_.limit_forward.in(bits)) return "; the forward limit switch is on";
  if (profile_.limit_reverse.in(bits)) return "; the reverse limit switch is on";
  return "";
}

double DriveLink::following_error() {
  if (profile_.following_error_register.empty()) return 0.0;
  const Register& from = *profile_.find(profile_.following_error_register);
  return from.scale * static_cast<double>(read(from.name));
}

void DriveLink::command(const Command& command, const MoveNumbers& numbers,
                        const std::function<bool()>& given_up) {
  for (const RegisterWrite& write : command) {
    const Register& to = *profile_.find(write.register_name);
    ask(write_request(to, write, numbers), {.repeatable = write.repeatable, .given_up = given_up});
  }
}

void DriveLink::command_once(const Command& command, const MoveNumbers& numbers,
                             const std::function<bool()>& given_up) {
  for (const RegisterWrite& write : command) {
    const Register& to = *profile_.find(write.register_name);
    ask(write_request(to, write, numbers), {.repeatable = false, .given_up = given_up});
  }
}

void DriveLink::stop(modbus_bus::Attempts attempts) {
  stop_drive(*bus_, station_, profile_, attempts);
}

std::vector<std::uint16_t> DriveLink::ask(const modbus_bus::Request& request,
                                          const modbus_bus::Manner& manner) {
  try {
    return bus_->transact(station_, request, manner);
  } catch (const DeviceError& error) {
    on_error_(error.code());
    throw;
  }
}

std::int64_t DriveLink::read(const std::string& register_name) {
  const Register& from = *profile_.find(register_name);
  return number_from_words(from, ask(read_request(from), {}));
}

}  // namespace gonio::modbus_stage
