#pragma once

#include <cstdint>
#include <sstream>
#include <string>

#include "gonio/aravis_camera/options.h"

namespace gonio::aravis_camera {

template <typename... Parts>
std::string joined(const Parts&... parts) {
  std::ostringstream text;
  (text << ... << parts);
  return text.str();
}

/// "320 x 256 px at 0, 0".
std::string as_text(const Region& region);

/// Name of a pixel format, or its code in hexadecimal when it is unknown.
std::string format_text(std::uint32_t code);

}  // namespace gonio::aravis_camera
