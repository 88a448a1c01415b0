#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

/// Modbus: requests, answers and the bytes between them. Pure functions; the line is modbus_bus.h.
/// Source: MODBUS Application Protocol Specification V1.1b3, sections 4 to 7.
namespace gonio::modbus_bus {

enum class Function : std::uint8_t {
  read_coils = 0x01,
  read_holding_registers = 0x03,
  read_input_registers = 0x04,
  write_coil = 0x05,
  write_register = 0x06,
  write_registers = 0x10
};

/// What one unit is asked. Made by the functions below, which refuse what no frame can hold.
struct Request {
  Function function{};
  std::uint16_t address = 0;
  std::uint16_t count = 0;           ///< coils or registers, read or written
  std::vector<std::uint16_t> words;  ///< written ones; a coil is 0 or 1

  bool reads() const;
  bool operator==(const Request&) const = default;
};

constexpr std::size_t kMaxReadCoils = 2000;
constexpr std::size_t kMaxReadRegisters = 125;
constexpr std::size_t kMaxWrittenRegisters = 123;

/// Each throws std::invalid_argument for a count that is 0, beyond the maxima above, or that runs
/// over the last address.
Request read_coils(std::uint16_t address, std::size_t count = 1);
Request read_holding_registers(std::uint16_t address, std::size_t count = 1);
Request read_input_registers(std::uint16_t address, std::size_t count = 1);
Request write_coil(std::uint16_t address, bool on);
Request write_register(std::uint16_t address, std::uint16_t word);
Request write_registers(std::uint16_t address, std::vector<std::uint16_t> words);

/// Unit and function with its data: a frame of RTU without its CRC, of TCP without its header.
std::vector<std::uint8_t> encode(int unit, const Request& request);

/// What a frame is, seen as the answer to a request.
struct Answer {
  enum class Kind {
    good,       ///< `words` holds what was read
    exception,  ///< the unit refuses; `exception` says why
    foreign,    ///< of another unit or to another request: the one waited for may still come
    malformed   ///< no Modbus answer at all
  };
  Kind kind{};
  std::vector<std::uint16_t> words;  ///< one per register or coil read
  int exception = 0;
  std::string what;  ///< of `foreign` and `malformed`: found, expected
};

/// Reads unit and function with its data as the answer to `request`. Never throws on bytes.
Answer decode(int unit, const Request& request, std::span<const std::uint8_t> frame);

/// "illegal address (02)", for a message.
std::string exception_text(int code);

}  // namespace gonio::modbus_bus
