#include "fault_rules.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>
#include <stdexcept>

#include "gonio/console/failures.h"
#include "gonio/console/suggest.h"

namespace gonio::emulate {
namespace {

using emulator_faults::Fault;
using Faults = std::vector<Fault>;

const Faults kModbusFaults{Fault::dead_link, Fault::exception, Fault::late_reply, Fault::torn_reply,
                           Fault::foreign_reply};
const Faults kUsbFaults{Fault::dead_link, Fault::torn_reply, Fault::stall, Fault::unplug};
const Faults kDriveFaults{Fault::alarm, Fault::limit_switch, Fault::never_in_position,
                          Fault::stop_ignored};
const Faults kCameraFaults{Fault::dead_link, Fault::lost_packets, Fault::wrong_exposure,
                           Fault::duplicate_frame_id, Fault::no_frame};

Faults operator+(Faults first, const Faults& second) {
  first.insert(first.end(), second.begin(), second.end());
  return first;
}

/// Of a device on a Modbus line, which the rig file has; only a serial one has checksums.
Faults on_modbus(const cli::RigFile& rig, const std::string& bus) {
  const bool serial = rig.devices.bus(bus)->kind == cli::BusEntry::Kind::modbus_rtu;
  return serial ? kModbusFaults + Faults{Fault::crc_error} : kModbusFaults;
}

Faults of_axis(const cli::RigFile& rig, const cli::AxisDevice& device) {
  switch (device.driver) {
    case cli::AxisDevice::Driver::modbus:
      return kDriveFaults + on_modbus(rig, device.bus) + Faults{Fault::power_cycle} +
             (device.profile == "oriental-az" ? Faults{} : Faults{Fault::lost_steps});
    case cli::AxisDevice::Driver::apt:
      return kDriveFaults + kUsbFaults + Faults{Fault::lost_move, Fault::lost_steps};
  }
  return {};
}

/// What each device of the rig can show.
std::map<std::string, Faults> faults_by_device(const cli::RigFile& rig) {
  std::map<std::string, Faults> faults;
  for (std::size_t i = 0; i < rig.rig.axes.size(); ++i) {
    faults[rig.rig.axes[i].name] = of_axis(rig, rig.devices.axes[i]);
  }
  faults["lamp"] = on_modbus(rig, rig.devices.lamp.bus);
  if (!rig.devices.changer.bus.empty()) {
    faults["changer"] = on_modbus(rig, rig.devices.changer.bus);
  }
  if (!rig.devices.monitor.serial.empty()) faults["monitor"] = kUsbFaults;
  faults["camera"] = kCameraFaults;
  return faults;
}

std::string names_of(const Faults& faults) {
  std::vector<std::string_view> names;
  for (const Fault fault : faults) names.push_back(to_string(fault));
  return fmt::format("{}", fmt::join(names, ", "));
}

bool holds(const Faults& faults, Fault fault) {
  return std::find(faults.begin(), faults.end(), fault) != faults.end();
}

void require_possible(const std::string& text, const emulator_faults::FaultRule& rule,
                      const std::map<std::string, Faults>& by_device) {
  if (rule.device.empty()) {
    const bool any = std::any_of(by_device.begin(), by_device.end(), [&](const auto& entry) {
      return holds(entry.second, rule.fault);
    });
    if (any) return;
    throw cli::UsageError(
        fmt::format("fault \"{}\": found no device of this rig that can show it", text));
  }
  const auto device = by_device.find(rule.device);
  if (device == by_device.end()) {
    std::vector<std::string> names;
    for (const auto& [name, faults] : by_device) names.push_back(name);
    throw cli::UsageError(fmt::format("fault \"{}\": found no device \"{}\"{}", text, rule.device,
                                      cli::did_you_mean(rule.device, names)));
  }
  if (holds(device->second, rule.fault)) return;
  throw cli::UsageError(fmt::format("fault \"{}\": {} cannot show it", text, rule.device),
                        fmt::format("it can show {}", names_of(device->second)));
}

}  // namespace

std::vector<emulator_faults::FaultRule> fault_rules(const std::vector<std::string>& texts,
                                                    const cli::RigFile& rig) {
  const std::map<std::string, Faults> by_device = faults_by_device(rig);
  std::vector<emulator_faults::FaultRule> rules;
  for (const std::string& text : texts) {
    try {
      rules.push_back(emulator_faults::fault_rule_from_text(text));
    } catch (const std::invalid_argument& error) {
      throw cli::UsageError(error.what());
    }
    require_possible(text, rules.back(), by_device);
  }
  return rules;
}

}  // namespace gonio::emulate
