#pragma once

#include <map>
#include <memory>
#include <stdexcept>
#include <string>

#include "gonio/apt_stage/apt_model.h"
#include "gonio/aravis_camera/options.h"
#include "gonio/console/failures.h"
#include "gonio/devices/stage_gate.h"
#include "gonio/modbus_bus/open_bus.h"
#include "gonio/modbus_changer/modbus_changer.h"
#include "gonio/modbus_light/modbus_light.h"
#include "gonio/setup/rig_file.h"
#include "gonio/usb_bus/usb_device.h"
#include "gonio/usbtmc_monitor/usbtmc_monitor.h"

/// From what a rig file says to what the drivers take.
namespace gonio::cli {

inline constexpr const char* kLampName = "lamp";
inline constexpr const char* kChangerName = "changer";
inline constexpr const char* kMonitorName = "monitor";
inline constexpr const char* kCameraName = "camera";

/// Ports by name, each opened when the first device on it is.
///
/// Threads  One.
class Buses {
 public:
  /// `devices` must outlive it. With `retries` instead of the rig file's when not negative.
  explicit Buses(const RigDevices& devices, int retries = -1)
      : devices_(devices), retries_(retries) {}

  /// Throws devices::DeviceError when the port does not open.
  std::shared_ptr<modbus_bus::ModbusBus> operator[](const std::string& name);

 private:
  const RigDevices& devices_;
  int retries_;
  std::map<std::string, std::shared_ptr<modbus_bus::ModbusBus>> open_;
};

devices::AxisSetup axis_setup(const rig::Axis& axis);
usb_bus::UsbAddress apt_address(const AxisDevice& device);
/// Throws std::invalid_argument for a model that is not known.
apt_stage::AptModel apt_model(const std::string& name);
modbus_light::LampProfile lamp_profile(const LampDevice& lamp);
modbus_changer::ChangerProfile changer_profile(const ChangerDevice& changer);
usb_bus::UsbAddress monitor_address(const MonitorDevice& monitor);
usbtmc_monitor::MonitorOptions monitor_options(const MonitorDevice& monitor);
aravis_camera::AravisCameraOptions camera_options(const RigFile& rig);

/// Runs `make`; what a driver refuses of its options was written in the rig file.
template <class Make>
auto from_rig_file(const RigFile& rig, const std::string& table, Make&& make) {
  try {
    return make();
  } catch (const std::invalid_argument& error) {
    throw UsageError(rig.path.string() + ": " + table + ": " + error.what());
  }
}

}  // namespace gonio::cli
