#include "gonio/modbus_bus/modbus_bus.h"

namespace gonio::modbus_bus {

devices::DeviceErrc errc_of_exception(int code) {
  switch (code) {
    case 0x05:
    case 0x06:
    case 0x0B:
      return devices::DeviceErrc::Timeout;
    case 0x08:
      return devices::DeviceErrc::Protocol;
    case 0x0A:
      return devices::DeviceErrc::Disconnected;
    case 0x01:
    case 0x02:
    case 0x03:
    case 0x04:
    case 0x07:
      return devices::DeviceErrc::Fault;
    default:
      return devices::DeviceErrc::Protocol;
  }
}

bool worth_repeating(int exception_code) {
  return exception_code == 0x06 || exception_code == 0x08;
}

}  // namespace gonio::modbus_bus
