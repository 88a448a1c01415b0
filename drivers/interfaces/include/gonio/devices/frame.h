#pragma once

#include <chrono>
#include <cstdint>
#include <string_view>
#include <vector>

namespace gonio::devices {

/// How the numbers of a frame are laid over the sensor. Bayer names give the 2 x 2 phase at the
/// top left pixel of this frame.
enum class PixelFormat { mono, bayer_rggb, bayer_grbg, bayer_gbrg, bayer_bggr };

std::string_view to_string(PixelFormat format);

/// One image as the sensor gave it, owning its pixels.
///
/// Pixels   Row-major from the top left, one std::uint16_t each, in DN, unpacked, not shifted.
/// Values   `exposure` is what the camera says it applied, not what was asked.
struct Frame {
  int width_px = 0;
  int height_px = 0;
  PixelFormat pixel_format = PixelFormat::mono;
  std::uint16_t saturation_level_dn = 0;  ///< a pixel at or above it carries no value
  double black_level_dn = 0.0;            ///< what the camera is set to, not a measured dark
  double gain_db = 0.0;
  std::chrono::nanoseconds exposure{0};
  std::chrono::nanoseconds exposure_start{0};  ///< on the session's Clock
  std::uint64_t frame_id = 0;                  ///< counts up by one per frame of this camera
  std::vector<std::uint16_t> pixels_dn;

  std::uint16_t at(int row, int column) const {
    return pixels_dn[static_cast<std::size_t>(row) * static_cast<std::size_t>(width_px) +
                     static_cast<std::size_t>(column)];
  }
};

}  // namespace gonio::devices
