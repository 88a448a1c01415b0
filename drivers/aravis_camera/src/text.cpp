#include "text.h"

#include "gonio/aravis_camera/wire_format.h"

namespace gonio::aravis_camera {

std::string as_text(const Region& region) {
  return joined(region.width, " x ", region.height, " px at ", region.x, ", ", region.y);
}

std::string format_text(std::uint32_t code) {
  const WireFormat* const known = find_wire_format(code);
  return known != nullptr ? std::string(known->name) : joined("0x", std::hex, code);
}

}  // namespace gonio::aravis_camera
