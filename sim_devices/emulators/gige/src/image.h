#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "gonio/devices/frame.h"

namespace gonio::gige_emulator {

/// How pixels go over the wire.
enum class Packing {
  bytes,          ///< one byte each
  words,          ///< two bytes each, little endian
  lsb_first,      ///< without gaps, first pixel in the lowest bits (PFNC "p")
  gev_12_packed,  ///< two pixels in three bytes, the low halves together in the middle one
};

struct PixelFormat {
  std::string_view name;
  std::uint32_t code;  ///< GenICam PFNC 2.4
  devices::PixelFormat layout;
  int bits;  ///< that carry a value
  int bits_on_wire;
  Packing packing;
};

/// Those a camera of this layout offers.
std::vector<PixelFormat> pixel_formats(devices::PixelFormat layout);
/// Null when there is none of this code.
const PixelFormat* pixel_format(std::uint32_t code);

/// What the camera does between its converter and the wire.
struct ImageSettings {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
  double gain_db = 0.0;
  double black_level_dn = 0.0;  ///< of the converter
  int adc_bits = 12;
};

/// Window, gain, black level, depth, packing. A window that leaves the frame gives black there.
std::vector<std::uint8_t> image(const devices::Frame& frame, const ImageSettings& settings,
                                const PixelFormat& format);

}  // namespace gonio::gige_emulator
