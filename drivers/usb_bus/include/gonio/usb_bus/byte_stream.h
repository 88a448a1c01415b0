#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "gonio/devices/device_error.h"

namespace gonio::usb_bus {

/// A serial line to one device: the seam under protocols that are bytes in a row.
///
/// State    Open and set up once constructed. After Disconnected nothing works until reconnect().
/// Threads  write(), connected() and disconnect() from any thread; the rest from the controlling
/// one. Errors   DeviceError: Timeout, Disconnected, Protocol (the line itself reports lost or
/// garbled
///          bytes).
class ByteStream {
 public:
  using Deadline = std::chrono::milliseconds;

  virtual ~ByteStream() = default;
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  virtual const std::string& name() const = 0;

  /// Sends all bytes in one piece, or throws within the line's own write deadline.
  virtual void write(std::span<const std::uint8_t> bytes) = 0;
  /// Returns as soon as anything has come; 0 when nothing did until the deadline (0: what is there
  /// already).
  virtual std::size_t read(std::span<std::uint8_t> room, Deadline deadline) = 0;
  /// Throws away what has come and was not read.
  virtual void purge() = 0;

  virtual bool connected() const noexcept = 0;
  /// Lets go of the device, as if it had been unplugged: of one that is not what was expected.
  virtual void disconnect() noexcept = 0;
  /// Looks for the device again and sets the line up; not connected unless both succeed. Throws
  /// Disconnected when it does not appear `within` the time, and what the set-up throws.
  virtual void reconnect(Deadline within) = 0;

 protected:
  ByteStream() = default;
};

}  // namespace gonio::usb_bus
