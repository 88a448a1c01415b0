// The devices that a rig file names, opened: the one place that knows the concrete drivers.

#include <fmt/format.h>

#include <cstdlib>
#include <functional>
#include <future>
#include <map>
#include <optional>
#include <utility>

#include "gonio/apt_stage/apt_stage.h"
#include "gonio/apt_stage/stop_apt.h"
#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/console/failures.h"
#include "gonio/devices/steady_clock.h"
#include "gonio/modbus_bus/open_bus.h"
#include "gonio/modbus_light/modbus_light.h"
#include "gonio/modbus_stage/modbus_stage.h"
#include "gonio/modbus_stage/stop_drive.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/opened_rig/watchdog.h"
#include "gonio/setup/drive_profile_file.h"
#include "gonio/usb_bus/ftdi_port.h"
#include "gonio/usbtmc_monitor/usbtmc_monitor.h"

namespace gonio::cli {
namespace {

using acquisition::DeviceSet;
using devices::DeviceError;

constexpr const char* kLampName = "lamp";
constexpr const char* kMonitorName = "monitor";
constexpr const char* kCameraName = "camera";
constexpr const char* kTimeScale = "GONIO_TIME_SCALE";  // docs/adr/0004

/// 1 on every rig of metal; `gonio-emulate` tells its command another.
double time_scale_of_environment() {
  const char* text = std::getenv(kTimeScale);
  if (text == nullptr) return 1.0;
  char* end = nullptr;
  const double scale = std::strtod(text, &end);
  if (end == text || *end != '\0' || !(scale > 0.0 && scale <= 1e6)) {
    throw UsageError(fmt::format("{}: found \"{}\", expected a number above 0", kTimeScale, text));
  }
  return scale;
}

std::shared_ptr<modbus_bus::ModbusBus> open_bus(const BusEntry& bus) {
  modbus_bus::BusOptions options;
  options.response_timeout = bus.response_timeout;
  options.retries = bus.retries;
  if (bus.kind == BusEntry::Kind::modbus_tcp) {
    return modbus_bus::open_tcp({bus.host, static_cast<std::uint16_t>(bus.tcp_port)}, options);
  }
  constexpr char kParity[] = {'N', 'E', 'O'};
  return modbus_bus::open_rtu(
      {bus.port, bus.baud, kParity[static_cast<std::size_t>(bus.parity)], bus.stop_bits}, options);
}

/// Ports by name, each opened when the first device on it is.
class Buses {
 public:
  explicit Buses(const RigDevices& devices) : devices_(devices) {}

  std::shared_ptr<modbus_bus::ModbusBus> operator[](const std::string& name) {
    auto& bus = open_[name];
    if (!bus) bus = open_bus(*devices_.bus(name));
    return bus;
  }

 private:
  const RigDevices& devices_;
  std::map<std::string, std::shared_ptr<modbus_bus::ModbusBus>> open_;
};

devices::AxisSetup setup_of(const rig::Axis& axis) {
  devices::AxisSetup setup;
  setup.name = axis.name;
  setup.limits = {axis.min, axis.max};
  setup.home = axis.home;
  setup.max_speed_deg_per_s = axis.max_speed_deg_per_s;
  setup.acceleration_deg_per_s2 = axis.acceleration_deg_per_s2;
  setup.settle = axis.settle;
  return setup;
}

/// What a driver refuses of its options was written in the rig file.
template <class Make>
auto from_rig_file(const RigFile& rig, const std::string& table, Make&& make) {
  try {
    return make();
  } catch (const std::invalid_argument& error) {
    throw UsageError(fmt::format("{}: {}: {}", rig.path.string(), table, error.what()));
  }
}

apt_stage::AptModel apt_model(const std::string& name) {
  const apt_stage::AptModel model = apt_stage::k10cr1();
  if (name == model.name) return model;
  throw std::invalid_argument(
      fmt::format("model: found \"{}\", expected \"{}\"", name, model.name));
}

usb_bus::UsbAddress apt_address(const AxisDevice& device) {
  return {apt_stage::kAptVendor, apt_stage::kAptProduct, device.serial, std::nullopt};
}

struct Stage {
  std::unique_ptr<devices::RotationStage> stage;
  std::string identity;
};

Stage open_stage(const RigFile& rig, std::size_t index, Buses& buses, devices::Clock& clock) {
  const rig::Axis& axis = rig.rig.axes[index];
  const AxisDevice& device = rig.devices.axes[index];
  return from_rig_file(rig, fmt::format("axis.{}.device", axis.name), [&]() -> Stage {
    if (device.driver == AxisDevice::Driver::apt) {
      auto port =
          std::make_shared<usb_bus::FtdiPort>(open_usb_device(axis.name, apt_address(device)));
      auto stage = std::make_unique<apt_stage::AptStage>(
          std::move(port), setup_of(axis), apt_model(device.model), device.reversed, clock);
      const auto& who = stage->identity();
      std::string identity = fmt::format("{} serial {}", who.model, who.serial);
      return {std::move(stage), std::move(identity)};
    }
    const auto profile = drive_profile(device.profile, rig.path.parent_path());
    modbus_stage::StageOptions options;
    options.confirmed = device.confirmed;
    auto stage = std::make_unique<modbus_stage::ModbusStage>(
        buses[device.bus], device.unit, setup_of(axis), profile,
        modbus_stage::DriveScale{device.steps_per_deg, device.reversed}, clock, options);
    return {std::move(stage),
            fmt::format("{}, unit {} on {}", profile.name, device.unit, buses[device.bus]->line())};
  });
}

std::unique_ptr<modbus_light::ModbusLight> open_lamp(const RigFile& rig, Buses& buses,
                                                     devices::Clock& clock) {
  const LampDevice& lamp = rig.devices.lamp;
  modbus_light::LampProfile profile;
  profile.shutter_coil = static_cast<std::uint16_t>(lamp.shutter_coil);
  profile.channel_register = static_cast<std::uint16_t>(lamp.channel_register);
  profile.temperature_register = static_cast<std::uint16_t>(lamp.temperature_register);
  profile.steady_time = lamp.steady;
  for (std::size_t i = 0; i < lamp.channels.size(); ++i) {
    const LampChannelEntry& channel = lamp.channels[i];
    profile.channels.push_back({channel.name, channel.wavelength_nm,
                                static_cast<std::uint16_t>(channel.number),
                                static_cast<std::uint16_t>(lamp.first_level_register + i),
                                static_cast<std::uint16_t>(channel.level)});
  }
  return from_rig_file(rig, kLampName, [&] {
    return std::make_unique<modbus_light::ModbusLight>(buses[lamp.bus], lamp.unit, kLampName,
                                                       profile, clock);
  });
}

std::unique_ptr<usbtmc_monitor::UsbtmcMonitor> open_monitor(const RigFile& rig) {
  const MonitorDevice& monitor = rig.devices.monitor;
  usb_bus::UsbAddress address;
  if (monitor.vendor_id != 0) address.vendor = static_cast<std::uint16_t>(monitor.vendor_id);
  if (monitor.product_id != 0) address.product = static_cast<std::uint16_t>(monitor.product_id);
  address.serial = monitor.serial;
  address.interface_class = usb_bus::kUsbtmcClass;
  usbtmc_monitor::MonitorOptions options;
  options.query = monitor.query;
  options.zero = monitor.zero;
  return from_rig_file(rig, kMonitorName, [&] {
    return std::make_unique<usbtmc_monitor::UsbtmcMonitor>(open_usb_device(kMonitorName, address),
                                                           options);
  });
}

std::unique_ptr<aravis_camera::AravisCamera> open_camera(const RigFile& rig,
                                                         const devices::SteadyClock& clock) {
  const CameraDevice& camera = rig.devices.camera;
  const sim::CameraOptions& nominal = rig.world.camera;
  aravis_camera::AravisCameraOptions options;
  options.name = kCameraName;
  options.device = camera.id;
  options.pixel_format = camera.pixel_format;
  options.region = {camera.offset_x_px, camera.offset_y_px, nominal.width_px, nominal.height_px};
  options.gain_db = camera.gain_db;
  options.gain_raw_per_db = camera.gain_raw_per_db;
  options.black_level_dn = camera.black_level_dn;
  options.black_level_unit_dn = camera.black_level_unit_dn;
  if (camera.trigger != "software") options.trigger_line = camera.trigger;
  options.packet_size = camera.packet_size_bytes;
  options.readout = nominal.readout;
  return from_rig_file(rig, "camera_device", [&] {
    return std::make_unique<aravis_camera::AravisCamera>(options, clock);
  });
}

/// Stops all drives on a port and closes the lamp's shutter if it is there.
void stop_bus(const RigFile& rig, const BusEntry& bus, devices::Clock& clock) {
  Buses buses(rig.devices);
  std::string failures;
  const auto attempt = [&](const auto& stop) {
    try {
      stop();
    } catch (const std::exception& error) {
      failures += (failures.empty() ? "" : "; ") + std::string(error.what());
    }
  };
  for (std::size_t i = 0; i < rig.devices.axes.size(); ++i) {
    const AxisDevice& device = rig.devices.axes[i];
    if (device.driver != AxisDevice::Driver::modbus || device.bus != bus.name) continue;
    attempt([&] {
      modbus_stage::stop_drive(*buses[bus.name], {rig.rig.axes[i].name, device.unit},
                               drive_profile(device.profile, rig.path.parent_path()));
    });
  }
  // Its constructor closes the shutter and makes sure.
  if (rig.devices.lamp.bus == bus.name) attempt([&] { open_lamp(rig, buses, clock); });
  if (!failures.empty()) throw std::runtime_error(failures);
}

class HardwareRig final : public OpenedRig {
 public:
  HardwareRig(const RigFile& rig, Parts parts)
      : clock_(time_scale_of_environment()), buses_(rig.devices), watchdog_(rig) {
    lamp_ = open_lamp(rig, buses_, clock_);
    for (std::size_t i = 0; i < rig.rig.axes.size(); ++i) {
      stages_.push_back(open_stage(rig, i, buses_, clock_));
    }
    if (parts == Parts::all) {
      if (!rig.devices.monitor.serial.empty()) monitor_ = open_monitor(rig);
      camera_ = open_camera(rig, clock_);
    }
    for (const Stage& each : stages_) devices_.stages.push_back(each.stage.get());
    devices_.light = lamp_.get();
    devices_.monitor = monitor_.get();
    devices_.camera = camera_.get();
    devices_.clock = &clock_;
  }

  /// An exception of the constructor comes here too only for what was open; the watchdog, which
  /// goes last, then still stands behind it.
  ~HardwareRig() override {
    for (const Stage& each : stages_) each.stage->stop();
    lamp_->close_shutter();
  }

  const DeviceSet& devices() override { return devices_; }
  double time_scale() const override { return clock_.time_scale(); }

  std::vector<DeviceIdentity> identities() override {
    std::vector<DeviceIdentity> all;
    for (const Stage& each : stages_) all.push_back({each.stage->name(), each.identity});
    all.push_back({kLampName, "Modbus lamp"});
    if (monitor_) all.push_back({kMonitorName, monitor_identity()});
    if (camera_) {
      const auto& who = camera_->identity();
      all.push_back(
          {kCameraName, fmt::format("{} {} serial {}", who.vendor, who.model, who.serial)});
    }
    return all;
  }

 private:
  std::string monitor_identity() const {
    const auto& who = monitor_->identity();
    return fmt::format("{} {} serial {} firmware {}", who.manufacturer, who.model, who.serial,
                       who.firmware);
  }

  devices::SteadyClock clock_;
  Buses buses_;
  Watchdog watchdog_;
  std::unique_ptr<modbus_light::ModbusLight> lamp_;
  std::vector<Stage> stages_;
  std::unique_ptr<usbtmc_monitor::UsbtmcMonitor> monitor_;
  std::unique_ptr<aravis_camera::AravisCamera> camera_;
  DeviceSet devices_;
};

}  // namespace

std::unique_ptr<OpenedRig> open_hardware_rig(const RigFile& rig, Parts parts) {
  return std::make_unique<HardwareRig>(rig, parts);
}

std::vector<std::string> stop_hardware_rig(const RigFile& rig) {
  // One task per port and device, so that a dead one takes no time from the others.
  const auto attempt = [](const std::string& what, const std::function<void()>& stop) {
    return std::async(std::launch::async, [what, stop]() -> std::string {
      try {
        stop();
        return {};
      } catch (const std::exception& error) {
        return what + ": " + error.what();
      }
    });
  };
  std::vector<std::future<std::string>> running;
  devices::SteadyClock clock;
  for (const BusEntry& bus : rig.devices.buses) {
    running.push_back(
        attempt("bus " + bus.name, [&rig, &bus, &clock] { stop_bus(rig, bus, clock); }));
  }
  for (std::size_t i = 0; i < rig.devices.axes.size(); ++i) {
    const AxisDevice& device = rig.devices.axes[i];
    if (device.driver != AxisDevice::Driver::apt) continue;
    const std::string& name = rig.rig.axes[i].name;
    running.push_back(attempt(name, [&name, &device] {
      usb_bus::FtdiPort port(open_usb_device(name, apt_address(device)));
      apt_stage::stop_apt(port);
    }));
  }
  std::vector<std::string> failures;
  for (std::future<std::string>& each : running) {
    if (std::string failure = each.get(); !failure.empty()) failures.push_back(std::move(failure));
  }
  return failures;
}

}  // namespace gonio::cli
