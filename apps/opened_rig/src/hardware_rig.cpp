// The devices that a rig file names, opened.

#include <fmt/format.h>

#include <atomic>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <future>
#include <mutex>
#include <optional>
#include <stop_token>
#include <utility>

#include "device_options.h"
#include "gonio/apt_stage/apt_stage.h"
#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/console/printable.h"
#include "gonio/devices/steady_clock.h"
#include "gonio/modbus_stage/modbus_stage.h"
#include "gonio/opened_rig/opened_rig.h"
#include "gonio/opened_rig/rig_lock.h"
#include "gonio/opened_rig/watchdog.h"
#include "gonio/setup/drive_profile_file.h"
#include "gonio/usb_bus/ftdi_port.h"

namespace gonio::cli {
namespace {

using acquisition::DeviceSet;
using devices::DeviceError;

// docs/adr/0004; the second names the emulated machine's folder, gone when it is.
constexpr const char* kTimeScale = "GONIO_TIME_SCALE";
constexpr const char* kEmulatedMachine = "UMOCKDEV_DIR";

/// 1 on every rig of metal; `gonio-emulate` tells its command another.
double time_scale_of_environment() {
  const char* text = std::getenv(kTimeScale);
  if (text == nullptr) return 1.0;
  char* end = nullptr;
  const double scale = std::strtod(text, &end);
  if (end == text || *end != '\0' || !(scale > 0.0 && scale <= 1e6)) {
    throw UsageError(fmt::format("{}: found \"{}\", expected a number above 0", kTimeScale, text));
  }
  // Axes of metal do not settle faster because of a variable that an emulation left behind.
  const char* machine = std::getenv(kEmulatedMachine);
  if (scale != 1.0 && (machine == nullptr || !std::filesystem::is_directory(machine))) {
    throw UsageError(
        fmt::format("{}: found \"{}\" outside of an emulated machine", kTimeScale, text),
        fmt::format("unset {}", kTimeScale));
  }
  return scale;
}

struct Stage {
  std::unique_ptr<devices::RotationStage> stage;
  std::function<void()> require_standing;  ///< throws where a stop was not obeyed
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
          std::move(port), axis_setup(axis), apt_model(device.model), device.reversed, clock,
          device.home_direction == AxisDevice::HomeDirection::rising
              ? apt_stage::HomeDirection::rising
              : apt_stage::HomeDirection::falling,
          device.counts_until_homed);
      const auto& who = stage->identity();
      std::string identity = fmt::format("{} serial {}", who.model, who.serial);
      auto* const opened = stage.get();
      return {std::move(stage), [opened] { opened->require_standing(); }, std::move(identity)};
    }
    const auto profile = drive_profile(device.profile, rig.path.parent_path());
    modbus_stage::StageOptions options;
    options.confirmed = device.confirmed;
    options.counts_until_homed = device.counts_until_homed;
    auto stage = std::make_unique<modbus_stage::ModbusStage>(
        buses[device.bus], device.unit, axis_setup(axis), profile,
        modbus_stage::DriveScale{device.steps_per_deg, device.reversed}, clock, options);
    auto* const opened = stage.get();
    return {std::move(stage), [opened] { opened->require_standing(); },
            fmt::format("{}, unit {} on {}", profile.name, device.unit, buses[device.bus]->line())};
  });
}

std::unique_ptr<modbus_light::ModbusLight> open_lamp(const RigFile& rig, Buses& buses,
                                                     devices::Clock& clock) {
  const LampDevice& lamp = rig.devices.lamp;
  return from_rig_file(rig, kLampName, [&] {
    return std::make_unique<modbus_light::ModbusLight>(buses[lamp.bus], lamp.unit, kLampName,
                                                       lamp_profile(lamp), clock);
  });
}

std::unique_ptr<modbus_changer::ModbusChanger> open_changer(const RigFile& rig, Buses& buses,
                                                            devices::Clock& clock) {
  const ChangerDevice& changer = rig.devices.changer;
  return from_rig_file(rig, kChangerName, [&] {
    return std::make_unique<modbus_changer::ModbusChanger>(
        buses[changer.bus], changer.unit, kChangerName, changer_profile(changer), clock);
  });
}

std::unique_ptr<usbtmc_monitor::UsbtmcMonitor> open_monitor(const RigFile& rig) {
  const MonitorDevice& monitor = rig.devices.monitor;
  return from_rig_file(rig, kMonitorName, [&] {
    return std::make_unique<usbtmc_monitor::UsbtmcMonitor>(
        open_usb_device(kMonitorName, monitor_address(monitor)), monitor_options(monitor));
  });
}

std::unique_ptr<aravis_camera::AravisCamera> open_camera(const RigFile& rig,
                                                         const devices::SteadyClock& clock,
                                                         const std::stop_token& stop) {
  return from_rig_file(rig, "camera_device", [&] {
    return std::make_unique<aravis_camera::AravisCamera>(camera_options(rig), clock, stop);
  });
}

class HardwareRig final : public OpenedRig {
 public:
  /// Opening moves nothing. The axes come first: their ports have one master, and whoever is second
  /// must not touch the lamp of the first.
  HardwareRig(const RigFile& rig, Parts parts, const std::stop_token& stop)
      : lock_(rig, parts),
        clock_(time_scale_of_environment()),
        watchdog_(rig, lock_.descriptors(), [this] { unwatched(); }),
        buses_(rig.devices) {
    // A program that is suspended would leave axes and shutter as they are.
    std::signal(SIGTSTP, SIG_IGN);
    const auto require_wanted = [&] {
      if (!stop.stop_requested()) return;
      throw DeviceError(devices::DeviceErrc::Stopped, "rig", "asked to stop while it was opened");
    };
    for (std::size_t i = 0; i < rig.rig.axes.size(); ++i) {
      require_wanted();
      stages_.push_back(open_stage(rig, i, buses_, clock_));
    }
    require_wanted();
    lamp_ = open_lamp(rig, buses_, clock_);
    if (parts == Parts::all) {
      require_wanted();
      if (!rig.devices.changer.bus.empty()) changer_ = open_changer(rig, buses_, clock_);
      require_wanted();
      if (!rig.devices.monitor.serial.empty()) monitor_ = open_monitor(rig);
      camera_ = open_camera(rig, clock_, stop);
    }
    for (const Stage& each : stages_) devices_.stages.push_back(each.stage.get());
    devices_.light = lamp_.get();
    devices_.changer = changer_.get();
    devices_.monitor = monitor_.get();
    devices_.camera = camera_.get();
    devices_.clock = &clock_;
    devices_.remarks = [this] { return remarks(); };
    {
      const std::lock_guard lock(opened_mutex_);
      opened_ = true;
    }
    if (lost_watchdog_) unwatched();
  }

  ~HardwareRig() override {
    try {
      require_safe();
    } catch (const std::exception& error) {
      std::fprintf(stderr, "gonio: %s\n", printable_line(error.what()).c_str());
      watchdog_.leave_to_act();  // once the ports are closed
    }
    const std::lock_guard lock(opened_mutex_);
    opened_ = false;
  }

  void require_safe() override {
    stop_all();
    // Then it is looked at, with patience, whether all obeyed. The first that did not is told.
    std::exception_ptr first;
    const auto look = [&](const auto& required) {
      try {
        required();
      } catch (const DeviceError&) {
        if (!first) first = std::current_exception();
      }
    };
    look([&] { lamp_->require_closed(); });
    for (const Stage& each : stages_) look(each.require_standing);
    if (first) std::rethrow_exception(first);
  }

  const DeviceSet& devices() override { return devices_; }
  double time_scale() const override { return clock_.time_scale(); }

  std::vector<DeviceIdentity> identities() override {
    std::vector<DeviceIdentity> all;
    for (const Stage& each : stages_) all.push_back({each.stage->name(), each.identity});
    all.push_back({kLampName, "Modbus lamp"});
    if (changer_) all.push_back({kChangerName, "Modbus target changer"});
    if (monitor_) all.push_back({kMonitorName, monitor_identity()});
    if (camera_) {
      const auto& who = camera_->identity();
      all.push_back(
          {kCameraName, fmt::format("{} {} serial {}", who.vendor, who.model, who.serial)});
    }
    return all;
  }

 private:
  /// All at the same time: one that does not answer keeps nothing else moving.
  void stop_all() {
    std::vector<std::future<void>> stops;
    for (const Stage& each : stages_) {
      stops.push_back(std::async(std::launch::async, [&each] { each.stage->stop(); }));
    }
    lamp_->close_shutter();
  }

  /// On the watchdog's thread: nobody would stop the rig if this program died now.
  void unwatched() {
    lost_watchdog_ = true;
    const std::lock_guard lock(opened_mutex_);
    if (!opened_) return;
    stop_all();
    std::fputs("gonio: the watchdog has died; the axes are stopped, the shutter is closed\n",
               stderr);
  }

  std::vector<std::string> remarks() const {
    if (!camera_) return {};
    return {std::string(kCameraName) + ": " + aravis_camera::to_text(camera_->counters())};
  }

  std::string monitor_identity() const {
    const auto& who = monitor_->identity();
    return fmt::format("{} {} serial {} firmware {}", who.manufacturer, who.model, who.serial,
                       who.firmware);
  }

  RigLock lock_;  ///< outlives everything that drives
  std::mutex opened_mutex_;
  bool opened_ = false;
  std::atomic<bool> lost_watchdog_ = false;
  devices::SteadyClock clock_;
  Watchdog watchdog_;  ///< goes last of what talks to devices
  Buses buses_;
  std::vector<Stage> stages_;
  std::unique_ptr<modbus_light::ModbusLight> lamp_;
  std::unique_ptr<modbus_changer::ModbusChanger> changer_;
  std::unique_ptr<usbtmc_monitor::UsbtmcMonitor> monitor_;
  std::unique_ptr<aravis_camera::AravisCamera> camera_;
  DeviceSet devices_;
};

}  // namespace

void check_hardware_options(const RigFile& rig) {
  for (std::size_t i = 0; i < rig.rig.axes.size(); ++i) {
    const AxisDevice& device = rig.devices.axes[i];
    from_rig_file(rig, fmt::format("axis.{}.device", rig.rig.axes[i].name), [&] {
      axis_setup(rig.rig.axes[i]).validate();
      if (device.driver == AxisDevice::Driver::apt) {
        apt_model(device.model).validate();
      } else {
        drive_profile(device.profile, rig.path.parent_path()).validate();
      }
    });
  }
  from_rig_file(rig, kLampName, [&] { lamp_profile(rig.devices.lamp).validate(); });
  if (!rig.devices.changer.bus.empty()) {
    from_rig_file(rig, kChangerName, [&] { changer_profile(rig.devices.changer).validate(); });
  }
  from_rig_file(rig, "camera_device", [&] { camera_options(rig).validate(); });
}

std::unique_ptr<OpenedRig> open_hardware_rig(const RigFile& rig, Parts parts,
                                             const std::stop_token& stop) {
  check_hardware_options(rig);
  return std::make_unique<HardwareRig>(rig, parts, stop);
}

}  // namespace gonio::cli
