#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace gonio::modbus_emulator {

enum class Table { coils, holding_registers, input_registers };

/// Codes a unit refuses a request with (MODBUS Application Protocol V1.1b3, 7).
enum class Exception : std::uint8_t {
  illegal_function = 0x01,
  illegal_address = 0x02,
  illegal_value = 0x03,
  device_failure = 0x04,
  busy = 0x06,
  damaged_request = 0x08
};

/// What stands behind one unit id: tables of coils and registers that do something.
///
/// Threads  One caller at a time; whoever puts it on a line sees to that.
class RegisterDevice {
 public:
  virtual ~RegisterDevice() = default;
  RegisterDevice(const RegisterDevice&) = delete;
  RegisterDevice& operator=(const RegisterDevice&) = delete;

  virtual const std::string& name() const = 0;
  virtual bool knows_function(std::uint8_t function) const = 0;

  /// `count` values from `first` on, all of one moment; none where an address does not exist.
  virtual std::optional<std::vector<std::uint16_t>> read(Table table, std::uint16_t first,
                                                         std::uint16_t count) = 0;
  /// Writes and does what that asks for. A coil is 0 or 1.
  virtual std::optional<Exception> write(Table table, std::uint16_t first,
                                         std::span<const std::uint16_t> values) = 0;

  /// Whether it answers a request of a wrong checksum (exception 08) instead of ignoring it.
  virtual bool answers_damaged_requests() const { return false; }

 protected:
  RegisterDevice() = default;
};

}  // namespace gonio::modbus_emulator
