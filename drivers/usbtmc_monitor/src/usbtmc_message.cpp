#include "gonio/usbtmc_monitor/usbtmc_message.h"

#include <fmt/format.h>

#include <stdexcept>

namespace gonio::usbtmc_monitor {
namespace {

constexpr std::uint8_t kEndOfMessage = 0x01;
constexpr std::size_t kAlignment = 4;

Bytes bulk_header(std::uint8_t id, std::uint8_t tag, std::uint32_t size, std::uint8_t attributes) {
  return {id,
          tag,
          static_cast<std::uint8_t>(~tag),
          0,
          static_cast<std::uint8_t>(size),
          static_cast<std::uint8_t>(size >> 8U),
          static_cast<std::uint8_t>(size >> 16U),
          static_cast<std::uint8_t>(size >> 24U),
          attributes,
          0,
          0,
          0};
}

}  // namespace

std::uint8_t next_tag(std::uint8_t tag) {
  return tag == 0xFF ? std::uint8_t{1} : static_cast<std::uint8_t>(tag + 1);
}

Bytes message_out(std::uint8_t tag, std::string_view text) {
  Bytes bytes =
      bulk_header(kDevDepMsgOut, tag, static_cast<std::uint32_t>(text.size()), kEndOfMessage);
  bytes.insert(bytes.end(), text.begin(), text.end());
  while (bytes.size() % kAlignment != 0) bytes.push_back(0);
  return bytes;
}

Bytes request_in(std::uint8_t tag, std::uint32_t most) {
  return bulk_header(kRequestDevDepMsgIn, tag, most, 0);
}

AnswerHeader answer_header(std::span<const std::uint8_t> transfer, std::uint32_t most) {
  const auto refuse = [](const std::string& why) { throw std::invalid_argument(why); };
  if (transfer.size() < kHeaderBytes) {
    refuse(fmt::format("an answer of {} bytes, expected a header of 12", transfer.size()));
  }
  if (transfer[0] != kDevDepMsgIn) {
    refuse(fmt::format("message id {}, expected 2", transfer[0]));
  }
  AnswerHeader header;
  header.tag = transfer[1];
  if (header.tag == 0 || (header.tag ^ transfer[2]) != 0xFF) {
    refuse(fmt::format("tag {:#04x} with inverse {:#04x}", transfer[1], transfer[2]));
  }
  for (std::size_t byte = 0; byte < 4; ++byte) {
    header.size |= std::uint32_t{transfer[4 + byte]} << (8 * byte);
  }
  if (header.size > most) {
    refuse(fmt::format("an answer of {} bytes, expected at most {}", header.size, most));
  }
  header.end = (transfer[8] & kEndOfMessage) != 0;
  return header;
}

std::string answer_text(std::span<const std::uint8_t> transfer, const AnswerHeader& header) {
  const std::size_t whole = kHeaderBytes + header.size;
  if (transfer.size() < whole) {
    throw std::invalid_argument(
        fmt::format("the answer broke off after {} of {} bytes", transfer.size(), whole));
  }
  if (transfer.size() >= whole + kAlignment) {
    throw std::invalid_argument(
        fmt::format("{} bytes behind an answer of {}", transfer.size() - whole, whole));
  }
  const auto text = transfer.subspan(kHeaderBytes, header.size);
  return {text.begin(), text.end()};
}

}  // namespace gonio::usbtmc_monitor
