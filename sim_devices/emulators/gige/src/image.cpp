#include "image.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace gonio::gige_emulator {
namespace {

using Layout = devices::PixelFormat;

constexpr PixelFormat kFormats[] = {
    {"Mono8", 0x01080001, Layout::mono, 8, 8, Packing::bytes},
    {"Mono10", 0x01100003, Layout::mono, 10, 16, Packing::words},
    {"Mono10p", 0x010A0046, Layout::mono, 10, 10, Packing::lsb_first},
    {"Mono12", 0x01100005, Layout::mono, 12, 16, Packing::words},
    {"Mono12p", 0x010C0047, Layout::mono, 12, 12, Packing::lsb_first},
    {"Mono12Packed", 0x010C0006, Layout::mono, 12, 12, Packing::gev_12_packed},
    {"Mono16", 0x01100007, Layout::mono, 16, 16, Packing::words},
    {"BayerRG8", 0x01080009, Layout::bayer_rggb, 8, 8, Packing::bytes},
    {"BayerRG10", 0x0110000D, Layout::bayer_rggb, 10, 16, Packing::words},
    {"BayerRG10p", 0x010A0058, Layout::bayer_rggb, 10, 10, Packing::lsb_first},
    {"BayerRG12", 0x01100011, Layout::bayer_rggb, 12, 16, Packing::words},
    {"BayerRG12p", 0x010C0059, Layout::bayer_rggb, 12, 12, Packing::lsb_first},
    {"BayerRG12Packed", 0x010C002B, Layout::bayer_rggb, 12, 12, Packing::gev_12_packed},
    {"BayerRG16", 0x0110002F, Layout::bayer_rggb, 16, 16, Packing::words},
    {"BayerGR8", 0x01080008, Layout::bayer_grbg, 8, 8, Packing::bytes},
    {"BayerGR10", 0x0110000C, Layout::bayer_grbg, 10, 16, Packing::words},
    {"BayerGR10p", 0x010A0056, Layout::bayer_grbg, 10, 10, Packing::lsb_first},
    {"BayerGR12", 0x01100010, Layout::bayer_grbg, 12, 16, Packing::words},
    {"BayerGR12p", 0x010C0057, Layout::bayer_grbg, 12, 12, Packing::lsb_first},
    {"BayerGR12Packed", 0x010C002A, Layout::bayer_grbg, 12, 12, Packing::gev_12_packed},
    {"BayerGR16", 0x0110002E, Layout::bayer_grbg, 16, 16, Packing::words},
    {"BayerGB8", 0x0108000A, Layout::bayer_gbrg, 8, 8, Packing::bytes},
    {"BayerGB10", 0x0110000E, Layout::bayer_gbrg, 10, 16, Packing::words},
    {"BayerGB10p", 0x010A0054, Layout::bayer_gbrg, 10, 10, Packing::lsb_first},
    {"BayerGB12", 0x01100012, Layout::bayer_gbrg, 12, 16, Packing::words},
    {"BayerGB12p", 0x010C0055, Layout::bayer_gbrg, 12, 12, Packing::lsb_first},
    {"BayerGB12Packed", 0x010C002C, Layout::bayer_gbrg, 12, 12, Packing::gev_12_packed},
    {"BayerGB16", 0x01100030, Layout::bayer_gbrg, 16, 16, Packing::words},
    {"BayerBG8", 0x0108000B, Layout::bayer_bggr, 8, 8, Packing::bytes},
    {"BayerBG10", 0x0110000F, Layout::bayer_bggr, 10, 16, Packing::words},
    {"BayerBG10p", 0x010A0052, Layout::bayer_bggr, 10, 10, Packing::lsb_first},
    {"BayerBG12", 0x01100013, Layout::bayer_bggr, 12, 16, Packing::words},
    {"BayerBG12p", 0x010C0053, Layout::bayer_bggr, 12, 12, Packing::lsb_first},
    {"BayerBG12Packed", 0x010C002D, Layout::bayer_bggr, 12, 12, Packing::gev_12_packed},
    {"BayerBG16", 0x01100031, Layout::bayer_bggr, 16, 16, Packing::words},
};

/// Values of the window, at the format's depth.
std::vector<unsigned> window(const devices::Frame& frame, const ImageSettings& settings, int bits) {
  const double largest = std::ldexp(1.0, settings.adc_bits) - 1.0;
  const double factor = std::pow(10.0, settings.gain_db / 20.0);
  const bool untouched = factor == 1.0 && settings.black_level_dn == frame.black_level_dn;
  const int shift = bits - settings.adc_bits;
  std::vector<unsigned> values;
  values.reserve(static_cast<std::size_t>(settings.width) *
                 static_cast<std::size_t>(settings.height));
  for (int row = settings.y; row < settings.y + settings.height; ++row) {
    for (int column = settings.x; column < settings.x + settings.width; ++column) {
      const bool inside = row < frame.height_px && column < frame.width_px;
      unsigned value = inside ? frame.at(row, column) : 0U;
      if (!untouched) {
        const double level = settings.black_level_dn + (value - frame.black_level_dn) * factor;
        value = static_cast<unsigned>(std::clamp(std::round(level), 0.0, largest));
      }
      values.push_back(shift >= 0 ? value << shift : value >> -shift);
    }
  }
  return values;
}

/// A stream of bits, lowest first.
std::vector<std::uint8_t> without_gaps(std::span<const unsigned> values, int bits) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(values.size() * static_cast<std::size_t>(bits) / 8 + 1);
  std::uint64_t waiting = 0;
  int held = 0;
  for (const unsigned value : values) {
    waiting |= static_cast<std::uint64_t>(value) << held;
    for (held += bits; held >= 8; held -= 8) {
      bytes.push_back(static_cast<std::uint8_t>(waiting & 0xFFU));
      waiting >>= 8;
    }
  }
  if (held > 0) bytes.push_back(static_cast<std::uint8_t>(waiting & 0xFFU));
  return bytes;
}

std::vector<std::uint8_t> gev_packed(std::span<const unsigned> values) {
  std::vector<std::uint8_t> bytes;
  for (std::size_t pair = 0; pair + 1 < values.size(); pair += 2) {
    const unsigned first = values[pair];
    const unsigned second = values[pair + 1];
    bytes.push_back(static_cast<std::uint8_t>(first >> 4));
    bytes.push_back(static_cast<std::uint8_t>((first & 0xFU) | ((second & 0xFU) << 4)));
    bytes.push_back(static_cast<std::uint8_t>(second >> 4));
  }
  return bytes;
}

}  // namespace

std::vector<PixelFormat> pixel_formats(devices::PixelFormat layout) {
  std::vector<PixelFormat> formats;
  std::copy_if(std::begin(kFormats), std::end(kFormats), std::back_inserter(formats),
               [&](const PixelFormat& format) { return format.layout == layout; });
  return formats;
}

const PixelFormat* pixel_format(std::uint32_t code) {
  const auto* const found =
      std::find_if(std::begin(kFormats), std::end(kFormats),
                   [&](const PixelFormat& format) { return format.code == code; });
  return found == std::end(kFormats) ? nullptr : found;
}

std::vector<std::uint8_t> image(const devices::Frame& frame, const ImageSettings& settings,
                                const PixelFormat& format) {
  const std::vector<unsigned> values = window(frame, settings, format.bits);
  switch (format.packing) {
    case Packing::bytes:
      return without_gaps(values, 8);
    case Packing::words:
      return without_gaps(values, 16);
    case Packing::lsb_first:
      return without_gaps(values, format.bits);
    case Packing::gev_12_packed:
      return gev_packed(values);
  }
  return {};
}

}  // namespace gonio::gige_emulator
