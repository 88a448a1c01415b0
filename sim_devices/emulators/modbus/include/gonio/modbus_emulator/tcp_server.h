#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "gonio/devices/clock.h"
#include "gonio/modbus_emulator/devices.h"
#include "gonio/modbus_emulator/wire_log.h"

namespace gonio::modbus_emulator {

/// Modbus TCP devices behind one address, each by its unit id; any number of connections.
///
/// Faults   As ModbusRtuLine; crc_error, which TCP does not have, strikes nothing. foreign_reply
///          answers another unit or another transaction.
/// Threads  One of its own, ended by the destructor; all members from any thread.
class ModbusTcpServer {
 public:
  struct Options {
    std::string address = "127.0.0.1";       ///< IPv4
    std::uint16_t port = 0;                  ///< 0: any free one
    std::chrono::milliseconds late_by{500};  ///< of late_reply, on the host's clock
  };

  /// Listens. `clock` is the world's and outlives the server; `faults` may be null. Throws
  /// std::system_error; std::invalid_argument for an address that is none.
  ModbusTcpServer(const Options& options, Faults faults, const devices::Clock& clock);
  ~ModbusTcpServer();
  ModbusTcpServer(const ModbusTcpServer&) = delete;
  ModbusTcpServer& operator=(const ModbusTcpServer&) = delete;

  /// As ModbusRtuLine::add().
  void add(int unit, std::unique_ptr<RegisterDevice> device);

  std::uint16_t port() const;
  const WireLog& wire_log() const;

 private:
  class Server;
  std::unique_ptr<Server> server_;
};

}  // namespace gonio::modbus_emulator
