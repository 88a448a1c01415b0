#include "gonio/aravis_camera/options.h"

#include <cmath>
#include <sstream>
#include <stdexcept>

#include "gonio/aravis_camera/wire_format.h"

namespace gonio::aravis_camera {
namespace {

// What every IPv4 link carries, and the largest IPv4 packet.
constexpr int kSmallestPacket = 576;
constexpr int kLargestPacket = 65535;

template <typename Found>
[[noreturn]] void refuse(const std::string& camera, const char* field, const Found& found,
                         const char* expected) {
  std::ostringstream text;
  text << "camera " << camera << ": " << field << ": found " << found << ", expected " << expected;
  throw std::invalid_argument(text.str());
}

}  // namespace

void AravisCameraOptions::validate() const {
  if (name.empty()) throw std::invalid_argument("camera: name: found none, expected a name");
  if (device.empty()) refuse(name, "device", "none", "an address or an id");
  if (find_wire_format(pixel_format) == nullptr) {
    refuse(name, "pixel_format", '"' + pixel_format + '"',
           "Mono or BayerRG, GR, GB, BG with 8, 10, 10p, 12, 12p, 12Packed or 16");
  }
  if (region.x < 0) refuse(name, "region x", region.x, "0 or more");
  if (region.y < 0) refuse(name, "region y", region.y, "0 or more");
  if (region.width < 0) refuse(name, "region width", region.width, "0 or more");
  if (region.height < 0) refuse(name, "region height", region.height, "0 or more");
  if ((region.width == 0) != (region.height == 0)) {
    refuse(name, "region height", region.height, "0 with a width of 0, above 0 with another");
  }
  if (!std::isfinite(gain_db)) refuse(name, "gain_db", gain_db, "a number");
  if (!(gain_raw_per_db >= 0.0 && std::isfinite(gain_raw_per_db))) {
    refuse(name, "gain_raw_per_db", gain_raw_per_db, "0 or more");
  }
  if (!(black_level_dn >= 0.0 && std::isfinite(black_level_dn))) {
    refuse(name, "black_level_dn", black_level_dn, "0 or more");
  }
  if (!(black_level_unit_dn > 0.0 && std::isfinite(black_level_unit_dn))) {
    refuse(name, "black_level_unit_dn", black_level_unit_dn, "above 0");
  }
  if (packet_size != 0 && (packet_size < kSmallestPacket || packet_size > kLargestPacket)) {
    refuse(name, "packet_size", packet_size, "0 or 576 to 65535 bytes");
  }
  if (readout.count() < 0) refuse(name, "readout", readout.count(), "0 ns or more");
  if (frame_margin.count() <= 0) refuse(name, "frame_margin", frame_margin.count(), "above 0 ms");
  if (retries < 0) refuse(name, "retries", retries, "0 or more");
  if (open_patience.count() < 0) {
    refuse(name, "open_patience", open_patience.count(), "0 ms or more");
  }
}

}  // namespace gonio::aravis_camera
