#include "device_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "config_ranges.h"
#include "gonio/errors/errors.h"

namespace gonio::cli {
namespace {

constexpr Range kUnit{1.0, 247.0};        // Modbus over Serial Line 1.02, section 2.2; 0 is for all
constexpr Range kRegister{0.0, 65535.0};  // of 16 bit
constexpr Range kUsbId{0.0, 65535.0};
constexpr Range kResponse{1.0, 1e4};

void visit_bus(ConfigVisitor& v, BusEntry& bus) {
  v.text("name", bus.name, "");
  v.enumeration("type", bus.kind, {"modbus_rtu", "modbus_tcp"}, "");
  if (bus.kind == BusEntry::Kind::modbus_rtu) {
    v.text("port", bus.port, "device file, for example /dev/ttyUSB0");
    v.integer("baud", bus.baud, {300.0, 4e6}, "");
    v.enumeration("parity", bus.parity, {"none", "even", "odd"}, "");
    v.integer("stop_bits", bus.stop_bits, {1.0, 2.0}, "");
  } else {
    v.text("host", bus.host, "name or address");
    v.integer("tcp_port", bus.tcp_port, {1.0, 65535.0}, "");
  }
  v.duration("response_timeout_ms", bus.response_timeout, kMillisecond, kResponse,
             "of one request");
  v.integer("retries", bus.retries, {0.0, 10.0}, "of a request without a good answer");
}

void visit_lamp(ConfigVisitor& v, LampDevice& lamp) {
  v.text("bus", lamp.bus, "name of a [[bus]]");
  v.integer("unit", lamp.unit, kUnit, "");
  v.integer("shutter_coil", lamp.shutter_coil, kRegister, "1: open");
  v.integer("channel_register", lamp.channel_register, kRegister, "holding: number of the channel");
  v.integer("first_level_register", lamp.first_level_register, kRegister,
            "holding: level of the first channel; the others follow");
  v.integer("temperature_register", lamp.temperature_register, kRegister, "input, 0.1 deg C");
  v.duration("steady_ms", lamp.steady, kMillisecond, {0.0, 6e5}, "from switching to steady light");
  v.array(
      "channel", "", lamp.channels.size(),
      [&](std::size_t count) { lamp.channels.assign(count, {}); },
      [&](std::size_t i) {
        LampChannelEntry& channel = lamp.channels[i];
        v.text("name", channel.name, "");
        v.number("wavelength_nm", channel.wavelength_nm, {0.0, 1e5}, "centre; 0: white");
        v.integer("number", channel.number, kRegister, "in the channel register");
        v.integer("level", channel.level, kRegister, "written to its level register");
      });
}

void visit_changer(ConfigVisitor& v, ChangerDevice& changer) {
  static const std::vector<std::string> kTargets = [] {
    std::vector<std::string> names;
    for (int i = 0; i <= static_cast<int>(devices::Target::colour_chart); ++i) {
      names.emplace_back(devices::to_string(static_cast<devices::Target>(i)));
    }
    return names;
  }();
  v.text("bus", changer.bus, "name of a [[bus]]; empty: a person changes the targets");
  v.integer("unit", changer.unit, kUnit, "");
  v.integer("command_register", changer.command_register, kRegister,
            "holding: number of the place to go to");
  v.integer("status_register", changer.status_register, kRegister,
            "input: number of the place it stands at, 0 on its way");
  v.duration("timeout_s", changer.timeout, 1.0, {1.0, 3600.0}, "of one change");
  v.array(
      "place", "", changer.places.size(),
      [&](std::size_t count) { changer.places.assign(count, {}); },
      [&](std::size_t i) {
        v.enumeration("target", changer.places[i].target, kTargets, "");
        v.integer("number", changer.places[i].number, kRegister, "in the registers, from 1");
      });
}

}  // namespace

bool ChangerDevice::carries(devices::Target target) const {
  return std::any_of(places.begin(), places.end(),
                     [&](const ChangerPlaceEntry& place) { return place.target == target; });
}

const BusEntry* RigDevices::bus(const std::string& name) const {
  const auto found = std::find_if(buses.begin(), buses.end(),
                                  [&](const BusEntry& each) { return each.name == name; });
  return found == buses.end() ? nullptr : &*found;
}

void visit_axis_device(ConfigVisitor& v, AxisDevice& device) {
  v.table("device", "", [&] {
    v.enumeration("driver", device.driver, {"modbus", "apt"}, "");
    if (device.driver == AxisDevice::Driver::modbus) {
      v.text("bus", device.bus, "name of a [[bus]]");
      v.integer("unit", device.unit, kUnit, "");
      v.text("profile", device.profile, "shipped name, or a file beside this one");
      v.texts("confirmed", device.confirmed, "unconfirmed registers you answer for");
      v.number("steps_per_deg", device.steps_per_deg, {0.0, 1e9}, "of the drive's position");
    } else {
      v.text("serial", device.serial, "as printed on the stage");
      v.text("model", device.model, "");
      v.enumeration("home_direction", device.home_direction, {"falling", "rising"},
                    "of the joint angle while the home mark is searched");
    }
    v.flag("reversed", device.reversed, "the drive counts against the joint angle");
    v.flag("counts_until_homed", device.counts_until_homed,
           "told to home, it counts on in its old zero: you have tried it");
  });
}

void visit_devices(ConfigVisitor& v, RigDevices& devices) {
  v.array(
      "bus", "Ports that devices share", devices.buses.size(),
      [&](std::size_t count) { devices.buses.assign(count, {}); },
      [&](std::size_t i) { visit_bus(v, devices.buses[i]); });
  v.table("lamp", "The lamp, over Modbus", [&] { visit_lamp(v, devices.lamp); });
  v.table("changer", "The motorised target changer, over Modbus",
          [&] { visit_changer(v, devices.changer); });
  v.table("monitor", "The photodiode that watches the lamp, over USBTMC", [&] {
    v.text("serial", devices.monitor.serial, "empty: there is none");
    v.integer("vendor_id", devices.monitor.vendor_id, kUsbId, "");
    v.integer("product_id", devices.monitor.product_id, kUsbId, "");
    v.text("query", devices.monitor.query, "SCPI, answered by one number");
    v.number("zero", devices.monitor.zero, {}, "what it shows in the dark, in its own unit");
  });
  v.table("camera_device", "The camera, GigE Vision or USB3 Vision", [&] {
    CameraDevice& camera = devices.camera;
    v.text("id", camera.id, "as `gonio devices` names it, or an IP address");
    v.text("pixel_format", camera.pixel_format, "GenICam name");
    v.integer("offset_x_px", camera.offset_x_px, {0.0, 65535.0}, "of the region of interest");
    v.integer("offset_y_px", camera.offset_y_px, {0.0, 65535.0}, "");
    v.number("gain_db", camera.gain_db, {0.0, 60.0}, "");
    v.number("gain_raw_per_db", camera.gain_raw_per_db, kNotNegative,
             "of cameras that have GainRaw only: its manual");
    v.number("black_level_dn", camera.black_level_dn, {0.0, 65535.0}, "");
    v.number("black_level_unit_dn", camera.black_level_unit_dn, kPositive,
             "what one unit of the camera's own feature is");
    v.text("trigger", camera.trigger, "\"software\", or an input line: \"Line1\"");
    v.integer("packet_size_bytes", camera.packet_size_bytes, {0.0, 65535.0},
              "0: the largest that gets through");
  });
}

void check_devices(const RigDevices& devices, const std::vector<std::string>& axis_names,
                   const ConfigReader& reader, const std::filesystem::path& place) {
  // A key that is not there is reported at its table.
  const auto refuse = [&](const std::string& table, const std::string& key,
                          const std::string& why) {
    const int line = reader.line_of(table + "." + key);
    throw ConfigError(place, line > 0 ? line : reader.line_of(table), table + "." + key, why);
  };
  const auto require = [&](const std::string& table, const std::string& key,
                           const std::string& value, const char* expected) {
    if (value.empty()) refuse(table, key, fmt::format("found none, expected {}", expected));
  };
  const auto require_bus = [&](const std::string& table, const std::string& bus) {
    require(table, "bus", bus, "the name of a [[bus]]");
    if (devices.bus(bus) != nullptr) return;
    std::string known;
    for (const BusEntry& each : devices.buses) known += (known.empty() ? "" : ", ") + each.name;
    refuse(table, "bus",
           fmt::format("found \"{}\", expected one of the [[bus]] names: {}", bus,
                       known.empty() ? "there is none" : known));
  };

  std::set<std::string> bus_names;
  std::map<std::string, std::string> ends;  // port or host and TCP port -> name of the bus
  for (std::size_t i = 0; i < devices.buses.size(); ++i) {
    const BusEntry& bus = devices.buses[i];
    const std::string table = fmt::format("bus[{}]", i);
    require(table, "name", bus.name, "a name");
    if (!bus_names.insert(bus.name).second) {
      refuse(table, "name", fmt::format("found \"{}\" twice, expected different names", bus.name));
    }
    if (bus.kind == BusEntry::Kind::modbus_rtu) {
      require(table, "port", bus.port, "a device file");
    } else {
      require(table, "host", bus.host, "a name or address");
    }
    const bool serial = bus.kind == BusEntry::Kind::modbus_rtu;
    const std::string end = serial ? bus.port : fmt::format("{}:{}", bus.host, bus.tcp_port);
    const auto [other, fresh] = ends.try_emplace(end, bus.name);
    if (!fresh) {
      refuse(table, serial ? "port" : "host",
             fmt::format("found {}, which is that of bus \"{}\": devices of one line share its "
                         "[[bus]]",
                         end, other->second));
    }
  }

  std::map<std::pair<std::string, int>, std::string> units;
  std::map<std::string, std::string> serials;
  const auto require_own_unit = [&](const std::string& table, const std::string& bus, int unit) {
    const auto [other, fresh] = units.try_emplace({bus, unit}, table);
    if (!fresh) {
      refuse(table, "unit",
             fmt::format("found {}, which is that of {} on bus \"{}\"", unit, other->second, bus));
    }
  };
  for (std::size_t i = 0; i < devices.axes.size(); ++i) {
    const AxisDevice& axis = devices.axes[i];
    const std::string table = fmt::format("axis.{}.device", axis_names[i]);
    if (axis.driver == AxisDevice::Driver::modbus) {
      require_bus(table, axis.bus);
      require(table, "profile", axis.profile, "a drive profile");
      if (!(axis.steps_per_deg > 0.0)) {
        refuse(table, "steps_per_deg",
               fmt::format("found {:g}, expected above 0", axis.steps_per_deg));
      }
      require_own_unit(table, axis.bus, axis.unit);
    } else {
      require(table, "serial", axis.serial, "the stage's serial number");
      const auto [other, fresh] = serials.try_emplace(axis.serial, table);
      if (!fresh) {
        refuse(table, "serial",
               fmt::format("found \"{}\", which is that of {}", axis.serial, other->second));
      }
    }
  }

  require_bus("lamp", devices.lamp.bus);
  require_own_unit("lamp", devices.lamp.bus, devices.lamp.unit);
  if (devices.lamp.channels.empty()) {
    refuse("lamp", "channel", "found none, expected at least one [[lamp.channel]]");
  }
  const int last_level =
      devices.lamp.first_level_register + static_cast<int>(devices.lamp.channels.size()) - 1;
  if (last_level > 65535) {
    refuse(
        "lamp", "first_level_register",
        fmt::format("found {}, with which the last of {} levels would stand at {}, expected at "
                    "most 65535",
                    devices.lamp.first_level_register, devices.lamp.channels.size(), last_level));
  }
  if (devices.lamp.channel_register >= devices.lamp.first_level_register &&
      devices.lamp.channel_register <= last_level) {
    refuse("lamp", "channel_register",
           fmt::format("found {}, which is a level's register", devices.lamp.channel_register));
  }
  std::set<std::string> channel_names;
  std::set<int> channel_numbers;
  for (std::size_t i = 0; i < devices.lamp.channels.size(); ++i) {
    const LampChannelEntry& channel = devices.lamp.channels[i];
    const std::string table = fmt::format("lamp.channel[{}]", i);
    require(table, "name", channel.name, "a name");
    if (!channel_names.insert(channel.name).second) {
      refuse(table, "name", fmt::format("found \"{}\" twice", channel.name));
    }
    if (!channel_numbers.insert(channel.number).second) {
      refuse(table, "number",
             fmt::format("found {} twice, expected a number of its own", channel.number));
    }
  }
  if (!devices.changer.bus.empty()) {
    require_bus("changer", devices.changer.bus);
    require_own_unit("changer", devices.changer.bus, devices.changer.unit);
  }
  require("camera_device", "id", devices.camera.id, "a camera's name or IP address");
}

}  // namespace gonio::cli
