#pragma once

#include <string>
#include <vector>

namespace gonio::cli {

/// A camera that Aravis finds, by GigE Vision discovery or on USB.
struct FoundCamera {
  std::string id;  ///< what a rig file calls it
  std::string model;
  std::string serial;
  std::string address;
  std::string protocol;
};

struct FoundSerialPort {
  std::string port;  ///< /dev/ttyUSB0
  std::string name;  ///< its stable name under /dev/serial/by-id; may be empty
};

struct FoundUsbDevice {
  int vendor_id = 0;
  int product_id = 0;
  std::string serial;  ///< empty where it may not be read
  std::string product;
};

struct ConnectedDevices {
  std::vector<FoundCamera> cameras;
  std::vector<FoundSerialPort> serial_ports;
  std::vector<FoundUsbDevice> usb;
  std::vector<std::string> not_looked_for;  ///< and why, one line each
};

/// Looks on all buses this program was built for; takes about a second for the cameras.
ConnectedDevices connected_devices();

}  // namespace gonio::cli
