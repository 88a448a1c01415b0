#include "connected_devices.h"

#include <algorithm>
#include <filesystem>

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
  return found;
}

}  // namespace gonio::cli
