#include "gonio/modbus_bus/request.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

namespace gonio::modbus_bus {
namespace {

constexpr std::uint8_t kExceptionBit = 0x80;
constexpr std::uint16_t kCoilOn = 0xFF00;
constexpr std::size_t kAddresses = 0x10000;

std::uint8_t high_byte(std::uint16_t word) { return static_cast<std::uint8_t>(word >> 8U); }
std::uint8_t low_byte(std::uint16_t word) { return static_cast<std::uint8_t>(word & 0xFFU); }

void append(std::vector<std::uint8_t>& bytes, std::uint16_t word) {
  bytes.push_back(high_byte(word));
  bytes.push_back(low_byte(word));
}

std::uint16_t word_at(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>((bytes[at] << 8U) | bytes[at + 1]);
}

std::uint16_t checked_count(std::uint16_t address, std::size_t count, std::size_t most) {
  if (count == 0 || count > most || address + count > kAddresses) {
    throw std::invalid_argument(fmt::format(
        "Modbus address 0x{:04X}: found {} values, expected 1 to {} within 16 bits of address",
        address, count, most));
  }
  return static_cast<std::uint16_t>(count);
}

/// What a written coil or register looks like in a frame.
std::uint16_t single_word(const Request& request) {
  const std::uint16_t word = request.words.front();
  if (request.function == Function::write_coil) return word != 0 ? kCoilOn : 0;
  return word;
}

Answer refused(Answer::Kind kind, std::string what) { return {kind, {}, 0, std::move(what)}; }

Answer decode_read(const Request& request, std::span<const std::uint8_t> data) {
  const bool coils = request.function == Function::read_coils;
  const std::size_t wanted = coils ? (request.count + 7U) / 8U : 2U * request.count;
  if (data.size() != data[0] + 1U) {
    return refused(Answer::Kind::malformed,
                   fmt::format("{} data bytes announced, {} found", data[0], data.size() - 1));
  }
  if (data[0] != wanted) {
    return refused(Answer::Kind::foreign,
                   fmt::format("answer of {} data bytes, expected {}", data[0], wanted));
  }
  Answer answer{Answer::Kind::good, {}, 0, {}};
  for (std::size_t i = 0; i < request.count; ++i) {
    answer.words.push_back(coils ? static_cast<std::uint16_t>((data[1 + i / 8] >> (i % 8)) & 1U)
                                 : word_at(data, 1 + 2 * i));
  }
  return answer;
}

Answer decode_write(const Request& request, std::span<const std::uint8_t> data) {
  if (data.size() != 4) {
    return refused(Answer::Kind::malformed, fmt::format("{} data bytes, expected 4", data.size()));
  }
  // A single write is echoed whole, a multiple one by its address and count.
  const std::uint16_t expected =
      request.function == Function::write_registers ? request.count : single_word(request);
  if (word_at(data, 0) != request.address || word_at(data, 2) != expected) {
    return refused(Answer::Kind::foreign,
                   fmt::format("answer to a write of 0x{:04X} to 0x{:04X}, expected 0x{:04X} to "
                               "0x{:04X}",
                               word_at(data, 2), word_at(data, 0), expected, request.address));
  }
  return {Answer::Kind::good, {}, 0, {}};
}

}  // namespace

bool Request::reads() const {
  return function == Function::read_coils || function == Function::read_holding_registers ||
         function == Function::read_input_registers;
}

Request read_coils(std::uint16_t address, std::size_t count) {
  return {Function::read_coils, address, checked_count(address, count, kMaxReadCoils), {}};
}

Request read_holding_registers(std::uint16_t address, std::size_t count) {
  return {Function::read_holding_registers,
          address,
          checked_count(address, count, kMaxReadRegisters),
          {}};
}

Request read_input_registers(std::uint16_t address, std::size_t count) {
  return {Function::read_input_registers,
          address,
          checked_count(address, count, kMaxReadRegisters),
          {}};
}

Request write_coil(std::uint16_t address, bool on) {
  return {Function::write_coil, address, 1, {static_cast<std::uint16_t>(on ? 1 : 0)}};
}

Request write_register(std::uint16_t address, std::uint16_t word) {
  return {Function::write_register, address, 1, {word}};
}

Request write_registers(std::uint16_t address, std::vector<std::uint16_t> words) {
  const std::uint16_t count = checked_count(address, words.size(), kMaxWrittenRegisters);
  return {Function::write_registers, address, count, std::move(words)};
}

std::vector<std::uint8_t> encode(int unit, const Request& request) {
  std::vector<std::uint8_t> bytes{static_cast<std::uint8_t>(unit),
                                  static_cast<std::uint8_t>(request.function)};
  append(bytes, request.address);
  if (request.reads()) {
    append(bytes, request.count);
  } else if (request.function == Function::write_registers) {
    append(bytes, request.count);
    bytes.push_back(static_cast<std::uint8_t>(2 * request.words.size()));
    for (const std::uint16_t word : request.words) append(bytes, word);
  } else {
    append(bytes, single_word(request));
  }
  return bytes;
}

Answer decode(int unit, const Request& request, std::span<const std::uint8_t> frame) {
  // The shortest answer is an exception: unit, function, code.
  if (frame.size() < 3) {
    return refused(Answer::Kind::malformed,
                   fmt::format("{} bytes, expected 3 or more", frame.size()));
  }
  if (frame[0] != unit) {
    return refused(Answer::Kind::foreign,
                   fmt::format("answer of unit {}, expected unit {}", frame[0], unit));
  }
  const auto function = static_cast<std::uint8_t>(request.function);
  if ((frame[1] & ~kExceptionBit) != function) {
    return refused(Answer::Kind::foreign, fmt::format("answer to function {:02X}, expected {:02X}",
                                                      frame[1] & ~kExceptionBit, function));
  }
  const std::span<const std::uint8_t> data = frame.subspan(2);
  if ((frame[1] & kExceptionBit) != 0) {
    if (data.size() != 1) {
      return refused(Answer::Kind::malformed,
                     fmt::format("exception of {} bytes, expected 1", data.size()));
    }
    return {Answer::Kind::exception, {}, data[0], {}};
  }
  return request.reads() ? decode_read(request, data) : decode_write(request, data);
}

std::string exception_text(int code) {
  static constexpr std::array<std::pair<int, const char*>, 10> kTexts{{
      {0x01, "illegal function"},
      {0x02, "illegal address"},
      {0x03, "illegal value"},
      {0x04, "device failure"},
      {0x05, "still working on it"},
      {0x06, "busy"},
      {0x07, "not acknowledged"},
      {0x08, "the unit received a damaged request"},  // Leadshine: CRC; the standard: memory parity
      {0x0A, "gateway path unavailable"},
      {0x0B, "no answer behind the gateway"},
  }};
  const auto* const found = std::find_if(kTexts.begin(), kTexts.end(),
                                         [&](const auto& text) { return text.first == code; });
  return fmt::format("{} ({:02X})", found == kTexts.end() ? "unknown exception" : found->second,
                     code);
}

}  // namespace gonio::modbus_bus
