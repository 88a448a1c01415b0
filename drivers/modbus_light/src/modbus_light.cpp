#include "gonio/modbus_light/modbus_light.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

namespace gonio::modbus_light {

using devices::DeviceErrc;
using devices::DeviceError;

namespace {

constexpr std::chrono::milliseconds kSteadySlice{20};  // how late a closing is noticed

LampProfile checked_profile(LampProfile profile) {
  profile.validate();
  return profile;
}

}  // namespace

void LampProfile::validate() const {
  if (channels.empty()) throw std::invalid_argument("lamp: channels: found none, expected one");
  std::set<std::string> names;
  for (const Channel& channel : channels) {
    if (channel.name.empty() || !names.insert(channel.name).second) {
      throw std::invalid_argument(fmt::format(
          "lamp: channel: found the name \"{}\", expected different names", channel.name));
    }
    if (!(channel.wavelength_nm >= 0.0 && std::isfinite(channel.wavelength_nm))) {
      throw std::invalid_argument(
          fmt::format("lamp: channel {}: wavelength_nm: found {:g}, "
                      "expected 0 or more",
                      channel.name, channel.wavelength_nm));
    }
    if (channel.level_register == channel_register) {
      throw std::invalid_argument(
          fmt::format("lamp: channel {}: level_register: found {}, which "
                      "is channel_register",
                      channel.name, channel.level_register));
    }
  }
  if (steady_time.count() < 0) {
    throw std::invalid_argument(
        fmt::format("lamp: steady_ms: found {}, expected 0 or more", steady_time.count()));
  }
  if (!std::isfinite(temperature_scale)) {
    throw std::invalid_argument("lamp: temperature_scale: expected a number");
  }
}

ModbusLight::ModbusLight(std::shared_ptr<modbus_bus::ModbusBus> bus, int unit, std::string name,
                         LampProfile profile, devices::Clock& clock)
    : bus_(std::move(bus)),
      station_{std::move(name), unit},
      profile_(checked_profile(std::move(profile))),
      clock_(clock) {
  close_and_verify(modbus_bus::Attempts::several);
}

ModbusLight::~ModbusLight() {
  if (!may_be_open_) return;
  try {
    close_and_verify(modbus_bus::Attempts::several);
  } catch (...) {  // there is nobody left to tell; require_closed() is for those who must know
  }
}

std::vector<devices::LightChannel> ModbusLight::channels() const {
  std::vector<devices::LightChannel> channels;
  for (const LampProfile::Channel& channel : profile_.channels) {
    channels.push_back({channel.name, channel.wavelength_nm});
  }
  return channels;
}

const LampProfile::Channel& ModbusLight::find(const std::string& channel) const {
  std::string known;
  for (const LampProfile::Channel& each : profile_.channels) {
    if (each.name == channel) return each;
    known += (known.empty() ? "" : ", ") + each.name;
  }
  throw std::invalid_argument(
      fmt::format("{}: no channel \"{}\", expected one of {}", station_.device, channel, known));
}

void ModbusLight::light(const std::string& channel) {
  const LampProfile::Channel& wanted = find(channel);
  require_closed_if_asked();
  const std::uint64_t closings = closings_;
  const bool was_lit = lit_ == channel && lit_at_closings_ == closings;
  lit_.clear();
  try {
    open_on(wanted, closings, was_lit);
  } catch (const DeviceError&) {
    close_shutter();  // it may have been opened, or be open from before
    throw;
  }
  lit_ = channel;
  lit_at_closings_ = closings;
}

void ModbusLight::open_on(const LampProfile::Channel& wanted, std::uint64_t closings,
                          bool was_lit) {
  const modbus_bus::Manner manner{.given_up = [this, closings] { return closings_ != closings; }};
  const auto send = [&](const modbus_bus::Request& request) {
    bus_->transact(station_, request, manner);
  };
  send(modbus_bus::write_register(wanted.level_register, wanted.level));
  send(modbus_bus::write_register(profile_.channel_register, wanted.number));
  may_be_open_ = true;
  send(modbus_bus::write_coil(profile_.shutter_coil, true));
  if (bus_->transact(station_, modbus_bus::read_coils(profile_.shutter_coil), manner)[0] == 0) {
    throw DeviceError(DeviceErrc::Fault, name(), "the shutter does not open; see the lamp");
  }
  const devices::Clock::Duration steady =
      clock_.now() + (was_lit ? std::chrono::milliseconds(0) : profile_.steady_time);
  while (clock_.now() < steady && closings_ == closings) {
    clock_.wait_until(std::min<devices::Clock::Duration>(steady, clock_.now() + kSteadySlice));
  }
  if (closings_ != closings) {
    throw DeviceError(DeviceErrc::Stopped, name(), "the shutter was closed meanwhile");
  }
}

void ModbusLight::close_shutter() noexcept {
  ++closings_;
  close_failed_ = true;
  try {
    close_and_verify(modbus_bus::Attempts::one);
    close_failed_ = false;
  } catch (...) {  // the next call says so
  }
}

void ModbusLight::require_closed() {
  ++closings_;
  close_failed_ = true;
  require_closed_if_asked();
}

void ModbusLight::close_and_verify(modbus_bus::Attempts attempts) {
  const modbus_bus::Manner urgent{.urgent = true, .attempts = attempts};
  bus_->transact(station_, modbus_bus::write_coil(profile_.shutter_coil, false), urgent);
  if (bus_->transact(station_, modbus_bus::read_coils(profile_.shutter_coil), urgent)[0] != 0) {
    throw DeviceError(DeviceErrc::Fault, station_.device,
                      "the shutter does not close; switch the lamp off");
  }
  may_be_open_ = false;
}

void ModbusLight::require_closed_if_asked() {
  if (!close_failed_) return;
  close_and_verify(modbus_bus::Attempts::several);
  close_failed_ = false;
}

double ModbusLight::temperature_c() {
  if (!profile_.temperature_register) {
    throw DeviceError(DeviceErrc::Fault, name(), "has no register for a temperature");
  }
  require_closed_if_asked();
  const auto words =
      bus_->ask(station_, modbus_bus::read_input_registers(*profile_.temperature_register));
  return profile_.temperature_scale * static_cast<std::int16_t>(words[0]);
}

}  // namespace gonio::modbus_light
