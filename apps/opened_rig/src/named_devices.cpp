// What a rig file says of its devices, in a person's words; opens nothing.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "device_options.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/setup/drive_profile_file.h"

namespace gonio::cli {
namespace {

std::string text_of_bus(const RigDevices& devices, const std::string& name) {
  const BusEntry* bus = devices.bus(name);
  if (bus == nullptr) return name;
  return bus->kind == BusEntry::Kind::modbus_rtu
             ? fmt::format("{} ({})", name, bus->port)
             : fmt::format("{} ({}:{})", name, bus->host, bus->tcp_port);
}

std::string text_of_drive(const RigFile& rig, const AxisDevice& device) {
  const modbus_stage::DriveProfile profile = drive_profile(device.profile, rig.path.parent_path());
  std::string text = fmt::format("Modbus, {}, unit {} on {}", profile.name, device.unit,
                                 text_of_bus(rig.devices, device.bus));
  std::vector<std::string> unconfirmed;
  for (const modbus_stage::Register& each : profile.registers) {
    const bool answered_for = std::find(device.confirmed.begin(), device.confirmed.end(),
                                        each.name) != device.confirmed.end();
    if (!each.confirmed && !answered_for) unconfirmed.push_back(each.name);
  }
  if (!unconfirmed.empty()) {
    text += fmt::format("; not confirmed by a manual: {} (see `confirmed` in the rig file)",
                        fmt::join(unconfirmed, ", "));
  }
  if (!profile.homed.exists()) {
    text += "; cannot say that it is homed: commands by hand need --home";
  }
  return text;
}

}  // namespace

std::vector<DeviceIdentity> named_devices(const RigFile& rig) {
  std::vector<DeviceIdentity> all;
  if (rig.driver != RigFile::Driver::hardware) return all;
  for (std::size_t i = 0; i < rig.rig.axes.size(); ++i) {
    const std::string& name = rig.rig.axes[i].name;
    const AxisDevice& device = rig.devices.axes[i];
    all.push_back({name, from_rig_file(rig, fmt::format("axis.{}.device", name), [&] {
                     const std::string text =
                         device.driver == AxisDevice::Driver::apt
                             ? fmt::format("APT, {} serial {}", device.model, device.serial)
                             : text_of_drive(rig, device);
                     return device.counts_until_homed ? text + "; homing tells what it had lost"
                                                      : text;
                   })});
  }
  all.push_back({kLampName, fmt::format("Modbus, unit {} on {}", rig.devices.lamp.unit,
                                        text_of_bus(rig.devices, rig.devices.lamp.bus))});
  if (!rig.devices.changer.bus.empty()) {
    all.push_back({kChangerName, fmt::format("Modbus, unit {} on {}", rig.devices.changer.unit,
                                             text_of_bus(rig.devices, rig.devices.changer.bus))});
  }
  if (!rig.devices.monitor.serial.empty()) {
    all.push_back({kMonitorName, fmt::format("USBTMC, serial {}", rig.devices.monitor.serial)});
  }
  all.push_back(
      {kCameraName, fmt::format("{}, {}", rig.devices.camera.id, rig.devices.camera.pixel_format)});
  return all;
}

}  // namespace gonio::cli
