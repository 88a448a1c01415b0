#include "gonio/modbus_emulator/frames.h"

namespace gonio::modbus_emulator {
namespace {

constexpr std::size_t kMaxPdu = 253;
constexpr std::size_t kTcpHeaderBytes = 7;
constexpr std::uint16_t kCoilIsOn = 0xFF00;

std::uint16_t word(std::span<const std::uint8_t> bytes, std::size_t at) {
  return static_cast<std::uint16_t>((bytes[at] << 8U) | bytes[at + 1]);
}

void put(Bytes& bytes, std::uint16_t value) {
  bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
  bytes.push_back(static_cast<std::uint8_t>(value & 0xFFU));
}

Bytes read_answer(RegisterDevice& device, std::span<const std::uint8_t> pdu, Table table) {
  const std::uint8_t function = pdu[0];
  if (pdu.size() != 5) return exception_pdu(function, Exception::illegal_value);
  const std::uint16_t count = word(pdu, 3);
  const bool coils = table == Table::coils;
  if (count == 0 || count > (coils ? 2000 : 125)) {
    return exception_pdu(function, Exception::illegal_value);
  }
  const auto values = device.read(table, word(pdu, 1), count);
  if (!values) return exception_pdu(function, Exception::illegal_address);
  Bytes reply{function};
  if (!coils) {
    reply.push_back(static_cast<std::uint8_t>(2 * count));
    for (const std::uint16_t value : *values) put(reply, value);
    return reply;
  }
  reply.push_back(static_cast<std::uint8_t>((count + 7) / 8));
  reply.resize(reply.size() + reply[1]);
  for (std::size_t i = 0; i < values->size(); ++i) {
    if ((*values)[i] != 0) reply[2 + i / 8] |= static_cast<std::uint8_t>(1U << (i % 8));
  }
  return reply;
}

/// The answer to a write is the head of the request.
Bytes written(RegisterDevice& device, std::span<const std::uint8_t> pdu, Table table,
              std::span<const std::uint16_t> values) {
  if (const auto refused = device.write(table, word(pdu, 1), values)) {
    return exception_pdu(pdu[0], *refused);
  }
  return {pdu.begin(), pdu.begin() + 5};
}

Bytes write_one(RegisterDevice& device, std::span<const std::uint8_t> pdu, Table table) {
  if (pdu.size() != 5) return exception_pdu(pdu[0], Exception::illegal_value);
  std::uint16_t value = word(pdu, 3);
  if (table == Table::coils) {
    if (value != 0 && value != kCoilIsOn) return exception_pdu(pdu[0], Exception::illegal_value);
    value = value == 0 ? 0 : 1;
  }
  return written(device, pdu, table, {&value, 1});
}

Bytes write_several(RegisterDevice& device, std::span<const std::uint8_t> pdu, Table table) {
  if (pdu.size() < 6) return exception_pdu(pdu[0], Exception::illegal_value);
  const std::size_t count = word(pdu, 3);
  const bool coils = table == Table::coils;
  const std::size_t bytes = coils ? (count + 7) / 8 : 2 * count;
  if (count == 0 || count > (coils ? 1968 : 123) || pdu[5] != bytes || pdu.size() != 6 + bytes) {
    return exception_pdu(pdu[0], Exception::illegal_value);
  }
  std::vector<std::uint16_t> values(count);
  for (std::size_t i = 0; i < count; ++i) {
    values[i] =
        coils ? static_cast<std::uint16_t>((pdu[6 + i / 8] >> (i % 8)) & 1U) : word(pdu, 6 + 2 * i);
  }
  return written(device, pdu, table, values);
}

}  // namespace

std::uint16_t crc16(std::span<const std::uint8_t> bytes) {
  std::uint16_t crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) {
      crc = static_cast<std::uint16_t>((crc & 1U) != 0 ? (crc >> 1U) ^ 0xA001U : crc >> 1U);
    }
  }
  return crc;
}

Bytes with_crc(Bytes frame) {
  const std::uint16_t crc = crc16(frame);
  frame.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8U));
  return frame;
}

bool crc_fits(std::span<const std::uint8_t> frame) {
  if (frame.size() < 3) return false;
  const std::uint16_t crc = crc16(frame.first(frame.size() - 2));
  return frame[frame.size() - 2] == (crc & 0xFFU) && frame[frame.size() - 1] == crc >> 8U;
}

std::optional<std::size_t> rtu_request_length(std::span<const std::uint8_t> bytes) {
  if (bytes.size() < 2) return std::nullopt;
  switch (bytes[1]) {
    case 0x01:
    case 0x02:
    case 0x03:
    case 0x04:
    case 0x05:
    case 0x06:
    case 0x08:
      return 8;
    case 0x0F:
    case 0x10:
      if (bytes.size() < 7) return std::nullopt;
      return 9U + bytes[6];
    default:
      return std::nullopt;
  }
}

TcpState tcp_request(std::span<const std::uint8_t> bytes, TcpRequest& request) {
  if (bytes.size() < kTcpHeaderBytes) return TcpState::incomplete;
  const std::size_t length = word(bytes, 4);  // of unit and PDU
  if (word(bytes, 2) != 0 || length < 2 || length > kMaxPdu + 1) return TcpState::broken;
  if (bytes.size() < 6 + length) return TcpState::incomplete;
  request.transaction = word(bytes, 0);
  request.unit = bytes[6];
  request.length = 6 + length;
  const auto pdu = bytes.subspan(kTcpHeaderBytes, length - 1);
  request.pdu.assign(pdu.begin(), pdu.end());
  return TcpState::whole;
}

Bytes tcp_frame(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu) {
  Bytes frame;
  put(frame, transaction);
  put(frame, 0);
  put(frame, static_cast<std::uint16_t>(pdu.size() + 1));
  frame.push_back(unit);
  frame.insert(frame.end(), pdu.begin(), pdu.end());
  return frame;
}

Bytes exception_pdu(std::uint8_t function, Exception exception) {
  return {static_cast<std::uint8_t>(function | 0x80U), static_cast<std::uint8_t>(exception)};
}

Bytes answer(RegisterDevice& device, std::span<const std::uint8_t> pdu) {
  if (pdu.empty()) return exception_pdu(0, Exception::illegal_function);
  const std::uint8_t function = pdu[0];
  if (pdu.size() > kMaxPdu) return exception_pdu(function, Exception::illegal_value);
  if (!device.knows_function(function)) {
    return exception_pdu(function, Exception::illegal_function);
  }
  switch (function) {
    case 0x01:
      return read_answer(device, pdu, Table::coils);
    case 0x03:
      return read_answer(device, pdu, Table::holding_registers);
    case 0x04:
      return read_answer(device, pdu, Table::input_registers);
    case 0x05:
      return write_one(device, pdu, Table::coils);
    case 0x06:
      return write_one(device, pdu, Table::holding_registers);
    case 0x08:  // loop-back test
      return {pdu.begin(), pdu.end()};
    case 0x0F:
      return write_several(device, pdu, Table::coils);
    case 0x10:
      return write_several(device, pdu, Table::holding_registers);
    default:
      return exception_pdu(function, Exception::illegal_function);
  }
}

}  // namespace gonio::modbus_emulator
