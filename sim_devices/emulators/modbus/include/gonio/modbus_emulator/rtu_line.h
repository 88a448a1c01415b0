#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "gonio/devices/clock.h"
#include "gonio/modbus_emulator/devices.h"
#include "gonio/modbus_emulator/wire_log.h"

namespace gonio::modbus_emulator {

/// An RS-485 line of Modbus RTU slaves behind a pseudo-terminal.
///
/// Pace     Requests and answers take the time that their bytes need at the line's baud rate, on
/// the
///          host's clock whatever the world's scale, and an answer comes at the earliest 3.5
///          characters after its request. Bytes cross a pseudo-terminal at once, so a whole answer
///          is delivered when its last byte would have arrived.
/// Faults   dead_link, exception (04), crc_error, late_reply, torn_reply, foreign_reply, by device
///          name, one opportunity per request.
/// Threads  One of its own, ended by the destructor; all members from any thread. The slave end
///          stays open in here, so that a master may come and go.
class ModbusRtuLine {
 public:
  struct Options {
    int baud = 115200;
    char parity = 'N';
    int stop_bits = 1;
    std::chrono::milliseconds late_by{500};  ///< of late_reply, on the host's clock
    /// A symbolic link to the port, made anew here and removed at the end; empty: none.
    std::filesystem::path link = {};
  };

  /// `clock` is the world's and outlives the line; `faults` may be null. Throws std::system_error.
  ModbusRtuLine(const Options& options, Faults faults, const devices::Clock& clock);
  ~ModbusRtuLine();
  ModbusRtuLine(const ModbusRtuLine&) = delete;
  ModbusRtuLine& operator=(const ModbusRtuLine&) = delete;

  /// Puts a device on the line. Throws std::invalid_argument: unit outside 1 to 247, or taken.
  void add(int unit, std::unique_ptr<RegisterDevice> device);

  /// The path a master opens.
  const std::string& port() const;
  const WireLog& wire_log() const;

 private:
  class Line;
  std::unique_ptr<Line> line_;
};

}  // namespace gonio::modbus_emulator
