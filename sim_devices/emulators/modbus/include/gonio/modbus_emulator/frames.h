#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gonio/modbus_emulator/register_device.h"

/// The slave's side of Modbus as pure functions. A PDU is a function code and its data.
namespace gonio::modbus_emulator {

using Bytes = std::vector<std::uint8_t>;

/// CRC-16 of Modbus RTU (reflected 0x8005, start 0xFFFF); sent low byte first.
std::uint16_t crc16(std::span<const std::uint8_t> bytes);

/// `frame` (unit and PDU) with its checksum behind.
Bytes with_crc(Bytes frame);
/// Whether the last two bytes are the checksum of those before.
bool crc_fits(std::span<const std::uint8_t> frame);

/// Length of the RTU request that begins `bytes`, checksum included; none while too few bytes are
/// there to tell, or when the function is not known and only silence ends the frame.
std::optional<std::size_t> rtu_request_length(std::span<const std::uint8_t> bytes);

/// Unit id and PDU of a TCP request, and what to answer it with.
struct TcpRequest {
  std::uint16_t transaction = 0;
  std::uint8_t unit = 0;
  Bytes pdu;
  std::size_t length = 0;  ///< bytes it took
};
enum class TcpState { whole, incomplete, broken };
/// The first request in `bytes`. `broken`: this is not Modbus TCP, close the connection.
TcpState tcp_request(std::span<const std::uint8_t> bytes, TcpRequest& request);
Bytes tcp_frame(std::uint16_t transaction, std::uint8_t unit, const Bytes& pdu);

/// Does what `pdu` asks `device` for and returns the PDU of the answer.
Bytes answer(RegisterDevice& device, std::span<const std::uint8_t> pdu);
Bytes exception_pdu(std::uint8_t function, Exception exception);

}  // namespace gonio::modbus_emulator
