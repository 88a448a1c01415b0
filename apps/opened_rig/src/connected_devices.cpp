#include "gonio/opened_rig/connected_devices.h"

#include <algorithm>
#include <filesystem>

#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/usb_bus/usb_device.h"

namespace gonio::cli {
namespace {

std::vector<FoundSerialPort> serial_ports() {
  namespace fs = std::filesystem;
  std::vector<FoundSerialPort> ports;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator("/dev", ignored)) {
    const std::string name = entry.path().filename().string();
    for (const char* prefix : {"ttyUSB", "ttyACM", "ttyAMA", "ttyRS485"}) {
      if (name.starts_with(prefix)) ports.push_back({entry.path().string(), ""});
    }
  }
  for (const auto& entry : fs::directory_iterator("/dev/serial/by-id", ignored)) {
    const fs::path target = fs::canonical(entry.path(), ignored);
    for (FoundSerialPort& port : ports) {
      if (port.port == target) port.name = entry.path().string();
    }
  }
  std::sort(ports.begin(), ports.end(),
            [](const auto& a, const auto& b) { return a.port < b.port; });
  return ports;
}

}  // namespace

ConnectedDevices connected_devices() {
  ConnectedDevices found;
  found.serial_ports = serial_ports();
  const auto look = [&](const char* what, const auto& search) {
    try {
      search();
    } catch (const std::exception& error) {
      found.not_looked_for.push_back(std::string(what) + ": " + error.what());
    }
  };
  look("USB", [&] {
    for (const auto& each : usb_bus::list_usb_devices()) {
      found.usb.push_back({each.vendor, each.product, each.serial,
                           each.trouble.empty() ? each.description : each.trouble});
    }
  });
  look("cameras", [&] {
    for (const auto& each : aravis_camera::list_cameras()) {
      found.cameras.push_back(
          {each.id, each.vendor + " " + each.model, each.serial, each.address, each.protocol});
    }
  });
  return found;
}

}  // namespace gonio::cli
