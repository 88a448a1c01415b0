// Stands in for libmodbus_bus.cpp in builds without the library.

#include "gonio/modbus_bus/open_bus.h"

namespace gonio::modbus_bus {
namespace {

[[noreturn]] std::shared_ptr<ModbusBus> refuse(const std::string& line) {
  throw devices::DeviceError(devices::DeviceErrc::Disconnected, line,
                             "this program was built without libmodbus");
}

}  // namespace

std::shared_ptr<ModbusBus> open_rtu(const RtuLine& line, const BusOptions&) { refuse(line.path); }

std::shared_ptr<ModbusBus> open_tcp(const TcpEndpoint& endpoint, const BusOptions&) {
  refuse(endpoint.host);
}

}  // namespace gonio::modbus_bus
