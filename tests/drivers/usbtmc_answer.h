#pragma once

#include <algorithm>
#include <string>

#include "gonio/usbtmc_monitor/usbtmc_message.h"

namespace gonio::usbtmc_monitor {

/// A whole answer as an instrument sends it, laid out by hand after the
/// specification.
///
/// `end`      Whether the message ends with it.
/// `padding`  Bytes behind it that do not count.
inline Bytes answer(std::uint8_t tag, const std::string& text, bool end = true,
                    std::size_t padding = 0) {
  const auto size = static_cast<std::uint32_t>(text.size());
  Bytes bytes{0x02,
              tag,
              static_cast<std::uint8_t>(~tag),
              0,
              static_cast<std::uint8_t>(size),
              static_cast<std::uint8_t>(size >> 8U),
              0,
              0,
              static_cast<std::uint8_t>(end ? 1 : 0),
              0,
              0,
              0};
  bytes.resize(12 + text.size());
  std::copy(text.begin(), text.end(), bytes.begin() + 12);
  bytes.resize(bytes.size() + padding, 0);
  return bytes;
}

}  // namespace gonio::usbtmc_monitor
