// What a watchdog does when its owner has died.

#include <chrono>
#include <functional>
#include <future>
#include <optional>
#include <thread>
#include <utility>

#include "device_options.h"
#include "gonio/apt_stage/stop_apt.h"
#include "gonio/devices/steady_clock.h"
#include "gonio/modbus_stage/stop_drive.h"
#include "gonio/opened_rig/stop_rig.h"
#include "gonio/setup/drive_profile_file.h"
#include "gonio/usb_bus/ftdi_port.h"

namespace gonio::cli {
namespace {

// A port may be held for a moment by what is left of its owner, and one device may be silent.
constexpr std::chrono::seconds kPatience{30};
constexpr std::chrono::milliseconds kBetweenRounds{50};

using Step = std::function<void()>;

/// Each step once, then again those that failed, until all are done or patience ends: a silent
/// device takes one attempt's time from the others, not all of its own. Returns the last failures.
std::vector<std::string> in_rounds(std::vector<Step> steps) {
  const auto deadline = std::chrono::steady_clock::now() + kPatience;
  while (true) {
    std::vector<Step> left;
    std::vector<std::string> failures;
    for (Step& step : steps) {
      try {
        step();
      } catch (const std::exception& error) {
        failures.emplace_back(error.what());  // names the device or its port
        left.push_back(std::move(step));
      }
    }
    if (left.empty() || std::chrono::steady_clock::now() >= deadline) return failures;
    steps = std::move(left);
    std::this_thread::sleep_for(kBetweenRounds);
  }
}

}  // namespace

RigStopper::RigStopper(RigFile rig) : rig_(std::move(rig)) {
  for (const AxisDevice& device : rig_.devices.axes) {
    std::optional<modbus_stage::DriveProfile> profile;
    if (device.driver == AxisDevice::Driver::modbus) {
      profile = drive_profile(device.profile, rig_.path.parent_path());
    }
    profiles_.push_back(std::move(profile));
  }
}

std::vector<std::string> RigStopper::stop() const {
  const RigDevices& devices = rig_.devices;
  devices::SteadyClock clock;
  std::vector<std::future<std::vector<std::string>>> ports;
  for (const BusEntry& bus : devices.buses) {
    ports.push_back(std::async(std::launch::async, [&, bus] {
      Buses buses(devices, 0);
      std::vector<Step> steps;
      // Its constructor closes the shutter and makes sure.
      if (devices.lamp.bus == bus.name) {
        steps.emplace_back([&] {
          modbus_light::ModbusLight(buses[bus.name], devices.lamp.unit, kLampName,
                                    lamp_profile(devices.lamp), clock);
        });
      }
      for (std::size_t i = 0; i < devices.axes.size(); ++i) {
        const AxisDevice& device = devices.axes[i];
        if (!profiles_[i] || device.bus != bus.name) continue;
        const std::string& name = rig_.rig.axes[i].name;
        steps.emplace_back([&, i, name] {
          modbus_stage::stop_drive(*buses[bus.name], {name, devices.axes[i].unit}, *profiles_[i]);
        });
      }
      return in_rounds(std::move(steps));
    }));
  }
  for (std::size_t i = 0; i < devices.axes.size(); ++i) {
    if (devices.axes[i].driver != AxisDevice::Driver::apt) continue;
    ports.push_back(std::async(std::launch::async, [&, i] {
      const std::string& name = rig_.rig.axes[i].name;
      return in_rounds({[&] {
        usb_bus::FtdiPort port(open_usb_device(name, apt_address(devices.axes[i])));
        apt_stage::stop_apt(port);
      }});
    }));
  }
  std::vector<std::string> failures;
  for (auto& port : ports) {
    for (std::string& failure : port.get()) failures.push_back(std::move(failure));
  }
  return failures;
}

}  // namespace gonio::cli
