#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

/// Bulk messages of the USB Test and Measurement Class as pure functions.
///
/// Source   USB-IF, "Universal Serial Bus Test and Measurement Class Specification (USBTMC)", 1.0,
///          section 3.2 and 3.3.
namespace gonio::usbtmc_monitor {

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::uint8_t kDevDepMsgOut = 1;
inline constexpr std::uint8_t kRequestDevDepMsgIn = 2;
inline constexpr std::uint8_t kDevDepMsgIn = 2;
inline constexpr std::size_t kHeaderBytes = 12;

/// 1 to 255, never 0.
std::uint8_t next_tag(std::uint8_t tag);

/// The text as one whole message (end of message set), padded to a multiple of four bytes.
Bytes message_out(std::uint8_t tag, std::string_view text);
/// Asks for an answer of at most `most` bytes.
Bytes request_in(std::uint8_t tag, std::uint32_t most);

/// What the first bytes of an answer say.
struct AnswerHeader {
  std::uint8_t tag = 0;
  std::uint32_t size = 0;  ///< of the text that follows
  bool end = false;        ///< of the message
};

/// Throws std::invalid_argument saying what is wrong: too short, not an answer, tag and inverse do
/// not belong together, more than `most` bytes.
AnswerHeader answer_header(std::span<const std::uint8_t> transfer, std::uint32_t most);

/// The text of a whole transfer: as long as its header says, and at most three bytes of padding.
/// Throws std::invalid_argument.
std::string answer_text(std::span<const std::uint8_t> transfer, const AnswerHeader& header);

}  // namespace gonio::usbtmc_monitor
