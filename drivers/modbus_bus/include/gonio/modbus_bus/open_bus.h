#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>

#include "gonio/modbus_bus/modbus_bus.h"

/// Modbus lines over libmodbus; only where the build has it (GONIO_WITH_MODBUS).
namespace gonio::modbus_bus {

/// A serial port, usually of an RS-485 adapter.
struct RtuLine {
  std::string path;  ///< "/dev/serial/by-id/..."; a name that stays when adapters are swapped
  int baud = 115200;
  char parity = 'N';  ///< N, E or O
  int stop_bits = 1;  ///< 1 or 2

  /// Throws std::invalid_argument naming the field.
  void validate() const;
  /// Of one character of 8 data bits.
  std::chrono::nanoseconds character_time() const;
};

struct TcpEndpoint {
  std::string host;  ///< an address, or a name that is looked up once, when the line is opened
  std::uint16_t port = 502;
};

struct BusOptions {
  /// From the last byte sent to the first of the answer. The time on the line is added to it.
  std::chrono::milliseconds response_timeout{300};
  int retries = 2;  ///< further attempts after the first
  /// After a failed attempt to open, callers hear Disconnected at once for so long.
  std::chrono::milliseconds reopen_interval{250};

  /// Throws std::invalid_argument naming the field.
  void validate() const;
};

/// Opens a line. It keeps the port for itself and leaves 3.5 characters of silence between frames.
///
/// Late     After an attempt without an answer the line is listened to for four times
/// response_timeout or until the answer comes, and after the next answer once more: a second one
/// shows that the first was the late one, and the request is asked again. Urgent requests wait for
/// neither. A write is matched by its echo in any case. After a wrong checksum, which may have been
/// noise before the answer, the line is listened to for one response_timeout in the same way.
/// Time     A transaction takes response_timeout and its time on the line at most; with all its
/// attempts and the listening, (1 + retries) times six times that.
/// Lost     A port that hung up is opened again at the next request.
/// Errors   std::invalid_argument; DeviceError Disconnected in the name of the line: it does not
///          open, or another program has it.
std::shared_ptr<ModbusBus> open_rtu(const RtuLine& line, const BusOptions& options = {});

/// Connects to a Modbus TCP device or gateway within response_timeout, at the first of the host's
/// addresses that takes it; later connections go there without asking for the name again, so that
/// no request ever waits for a name server. Answers are matched by
/// transaction id. A connection without an answer is closed and opened anew, and so is one that the
/// other side has closed while nothing was asked.
std::shared_ptr<ModbusBus> open_tcp(const TcpEndpoint& endpoint, const BusOptions& options = {});

}  // namespace gonio::modbus_bus
