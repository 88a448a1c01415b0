#pragma once

#include <deque>
#include <optional>
#include <span>

#include "gonio/apt_stage/apt_messages.h"

namespace gonio::apt_stage {

/// Finds messages to the host in a stream of bytes.
///
/// A header counts as one when it is addressed to the host, comes from a unit, and, where the
/// message is known, has its kind and length; otherwise one byte is skipped and the next place
/// tried. So garbage costs the bytes up to the next message, and a message whose end is missing at
/// most one more: then clear() and ask again.
///
/// Threads  One.
class AptDecoder {
 public:
  void feed(std::span<const std::uint8_t> bytes);
  std::optional<Message> next();
  void clear() { bytes_.clear(); }

  std::size_t pending() const { return bytes_.size(); }  ///< bytes of a message not yet whole
  std::size_t skipped() const { return skipped_; }       ///< bytes that belonged to none, so far

 private:
  std::deque<std::uint8_t> bytes_;
  std::size_t skipped_ = 0;
};

}  // namespace gonio::apt_stage
