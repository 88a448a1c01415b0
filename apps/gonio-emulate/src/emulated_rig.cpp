#include "emulated_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>

#include "gonio/console/failures.h"
#include "gonio/gige_emulator/gige_camera.h"
#include "gonio/modbus_emulator/devices.h"
#include "gonio/modbus_emulator/rtu_line.h"
#include "gonio/modbus_emulator/tcp_server.h"
#include "gonio/sim/sim_goniometer.h"
#include "gonio/usb_emulator/usb_testbed.h"

namespace gonio::emulate {
namespace {

using cli::AxisDevice;
using cli::BusEntry;
using cli::RigFile;
using cli::UsageError;

constexpr const char* kLamp = "lamp";
constexpr const char* kChanger = "changer";
constexpr const char* kMonitor = "monitor";
constexpr const char* kCamera = "camera";
constexpr std::string_view kLoopback = "127.";

char parity_letter(BusEntry::Parity parity) {
  switch (parity) {
    case BusEntry::Parity::none:
      return 'N';
    case BusEntry::Parity::even:
      return 'E';
    case BusEntry::Parity::odd:
      break;
  }
  return 'O';
}

void require_loopback(const RigFile& rig, const std::string& key, const std::string& address) {
  if (address.starts_with(kLoopback)) return;
  throw UsageError(
      fmt::format("{}: {}: found \"{}\", expected an address that begins with 127. to emulate it",
                  rig.path.string(), key, address),
      "nothing is ever emulated on a network that others use; copy the rig file and change it");
}

std::unique_ptr<modbus_emulator::RegisterDevice> drive_of(
    const RigFile& rig, std::size_t index, const modbus_emulator::DriveMechanics& mechanics,
    const modbus_emulator::Faults& faults) {
  const std::string& name = rig.rig.axes[index].name;
  const std::string& profile = rig.devices.axes[index].profile;
  if (profile == "leadshine-em2rs") return leadshine_drive(name, mechanics, faults);
  if (profile == "oriental-az") return az_drive(name, mechanics, faults);
  throw UsageError(fmt::format(
      "{}: axis.{}.device.profile: found \"{}\", expected leadshine-em2rs or oriental-az, the "
      "drives that can be emulated",
      rig.path.string(), name, profile));
}

modbus_emulator::LampLayout layout_of(const cli::LampDevice& lamp) {
  modbus_emulator::LampLayout layout;
  layout.shutter_coil = static_cast<std::uint16_t>(lamp.shutter_coil);
  layout.channel_register = static_cast<std::uint16_t>(lamp.channel_register);
  layout.first_level_register = static_cast<std::uint16_t>(lamp.first_level_register);
  layout.temperature_register = static_cast<std::uint16_t>(lamp.temperature_register);
  int highest = 0;
  for (const auto& channel : lamp.channels) highest = std::max(highest, channel.level);
  layout.full_level = static_cast<std::uint16_t>(highest);
  return layout;
}

modbus_emulator::ChangerLayout layout_of(const cli::ChangerDevice& changer) {
  modbus_emulator::ChangerLayout layout;
  layout.command_register = static_cast<std::uint16_t>(changer.command_register);
  layout.status_register = static_cast<std::uint16_t>(changer.status_register);
  for (const cli::ChangerPlaceEntry& place : changer.places) {
    layout.places.push_back({place.target, static_cast<std::uint16_t>(place.number)});
  }
  return layout;
}

}  // namespace

/// The world first, what shows it after it: destroyed the other way round.
class EmulatedRig::Parts {
 public:
  Parts(const RigFile& rig, const sim::SimOptions& options,
        std::vector<emulator_faults::FaultRule> rules, std::uint64_t seed)
      : faults(std::make_shared<emulator_faults::FaultPlan>(std::move(rules), seed)),
        world(options),
        usb(*faults, world.clock()),
        watch(world) {
    for (const BusEntry& bus : rig.devices.buses) add_bus(rig, bus);
    for (std::size_t i = 0; i < rig.devices.axes.size(); ++i) {
      const AxisDevice& device = rig.devices.axes[i];
      const rig::Axis& axis = rig.rig.axes[i];
      if (device.driver != AxisDevice::Driver::apt) continue;
      usb.add_apt_stage({axis.name, device.serial, axis.home, device.reversed}, world.joint(i));
      addresses.push_back(fmt::format("{}: USB, serial {}", axis.name, device.serial));
    }
    if (!rig.devices.monitor.serial.empty()) {
      usb.add_power_meter({kMonitor, rig.devices.monitor.serial}, world.lamp_monitor());
      addresses.push_back(fmt::format("{}: USB, serial {}", kMonitor, rig.devices.monitor.serial));
    }
    add_camera(rig);
  }

  std::shared_ptr<emulator_faults::FaultPlan> faults;
  sim::SimGoniometer world;
  usb_emulator::UsbTestbed usb;
  std::vector<std::unique_ptr<modbus_emulator::ModbusRtuLine>> lines;
  std::vector<std::unique_ptr<modbus_emulator::ModbusTcpServer>> servers;
  std::optional<gige_emulator::GigeCamera> camera;
  AxisWatch watch;
  std::vector<std::string> addresses;

 private:
  void add_bus(const RigFile& rig, const BusEntry& bus) {
    if (bus.kind == BusEntry::Kind::modbus_rtu) {
      modbus_emulator::ModbusRtuLine::Options options;
      options.baud = bus.baud;
      options.parity = parity_letter(bus.parity);
      options.stop_bits = bus.stop_bits;
      options.late_by = 2 * bus.response_timeout;
      auto line = std::make_unique<modbus_emulator::ModbusRtuLine>(options, faults, world.clock());
      add_units(rig, bus, *line);
      usb.add_serial_port(bus.port, line->port());
      addresses.push_back(fmt::format("bus {}: {} is {}", bus.name, bus.port, line->port()));
      lines.push_back(std::move(line));
      return;
    }
    require_loopback(rig, "bus." + bus.name + ".host", bus.host);
    modbus_emulator::ModbusTcpServer::Options options;
    options.address = bus.host;
    options.port = static_cast<std::uint16_t>(bus.tcp_port);
    options.late_by = 2 * bus.response_timeout;
    auto server =
        std::make_unique<modbus_emulator::ModbusTcpServer>(options, faults, world.clock());
    add_units(rig, bus, *server);
    addresses.push_back(fmt::format("bus {}: {}:{}", bus.name, bus.host, server->port()));
    servers.push_back(std::move(server));
  }

  template <class Line>
  void add_units(const RigFile& rig, const BusEntry& bus, Line& line) {
    for (std::size_t i = 0; i < rig.devices.axes.size(); ++i) {
      const AxisDevice& device = rig.devices.axes[i];
      if (device.driver != AxisDevice::Driver::modbus || device.bus != bus.name) continue;
      modbus_emulator::DriveMechanics mechanics;
      mechanics.joint = &world.joint(i);
      mechanics.clock = &world.clock();
      mechanics.home = rig.rig.axes[i].home;
      mechanics.steps_per_deg = device.steps_per_deg;
      mechanics.reversed = device.reversed;
      line.add(device.unit, drive_of(rig, i, mechanics, faults));
    }
    if (rig.devices.lamp.bus == bus.name) {
      line.add(rig.devices.lamp.unit,
               modbus_emulator::lamp(kLamp, world.light_source(), layout_of(rig.devices.lamp)));
    }
    if (rig.devices.changer.bus == bus.name) {
      line.add(rig.devices.changer.unit, modbus_emulator::changer(kChanger, world.target_changer(),
                                                                  layout_of(rig.devices.changer)));
    }
  }

  void add_camera(const RigFile& rig) {
    require_loopback(rig, "camera_device.id", rig.devices.camera.id);
    gige_emulator::GigeCameraOptions options;
    options.name = kCamera;
    options.address = rig.devices.camera.id;
    options.adc_bits = rig.world.camera.bits;
    options.black_level_dn = rig.world.camera.black_level_dn;
    camera.emplace(options, world.camera(), world.clock(), *faults);
    addresses.push_back(fmt::format("{}: GigE Vision at {}", kCamera, options.address));
  }
};

EmulatedRig::EmulatedRig(const RigFile& rig, const sim::SimOptions& world,
                         std::vector<emulator_faults::FaultRule> faults, std::uint64_t seed)
    : parts_(std::make_unique<Parts>(rig, world, std::move(faults), seed)),
      time_scale_(world.time_scale.value_or(1.0)) {}

EmulatedRig::~EmulatedRig() = default;

std::map<std::string, std::string> EmulatedRig::environment() const {
  std::map<std::string, std::string> all{{"GONIO_TIME_SCALE", fmt::format("{}", time_scale_)}};
  for (const auto& [name, value] : parts_->usb.environment()) all[name] = value;
  return all;
}

std::filesystem::path EmulatedRig::folder() const { return parts_->usb.folder(); }

emulator_faults::FaultPlan& EmulatedRig::faults() { return *parts_->faults; }

sim::SimGoniometer& EmulatedRig::world() { return parts_->world; }

std::vector<std::string> EmulatedRig::addresses() const { return parts_->addresses; }

TimeAccount EmulatedRig::account(const Interval& command) const {
  std::vector<Interval> exposures;
  for (const auto& each : parts_->camera->log().exposures) {
    exposures.push_back({each.start, each.end});
  }
  std::vector<Interval> wire;
  for (const auto& line : parts_->lines) {
    for (const auto& each : line->wire_log().intervals()) wire.push_back({each.from, each.to});
  }
  return account_of(command, parts_->watch.intervals(), exposures, wire);
}

}  // namespace gonio::emulate
