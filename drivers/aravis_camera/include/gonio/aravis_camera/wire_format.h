#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "gonio/devices/frame.h"

namespace gonio::aravis_camera {

/// How pixels lie in the bytes that a camera sends. Lines follow each other without padding.
enum class Packing {
  byte,           ///< one byte per pixel
  word,           ///< 16 bits, little endian, unused bits above the value are 0
  lsb_10p,        ///< PFNC "10p": four pixels in five bytes, lowest bits first
  lsb_12p,        ///< PFNC "12p": two pixels in three bytes, lowest bits first
  gev_12_packed,  ///< GigE Vision "12Packed": high byte, both low halves, high byte
};

/// One pixel format of the GenICam standard.
struct WireFormat {
  std::string_view name;  ///< of the feature PixelFormat, for example "BayerRG12p"
  std::uint32_t code;
  devices::PixelFormat layout;
  Packing packing;
  int bits;  ///< of a value
};

/// All that are understood: Mono and BayerRG, GR, GB, BG with 8, 10, 10p, 12, 12p, 12Packed, 16.
/// Source  GenICam Pixel Format Naming Convention 2.4; GigE Vision 2.0, 25.
std::span<const WireFormat> wire_formats();

/// Null when it is none of them.
const WireFormat* find_wire_format(std::string_view name);
const WireFormat* find_wire_format(std::uint32_t code);

/// Bytes of `pixels` pixels; a last byte may be used in part.
std::size_t packed_size(Packing packing, std::size_t pixels);

}  // namespace gonio::aravis_camera
