#include "gonio/aravis_camera/wire_format.h"

#include <algorithm>
#include <array>

namespace gonio::aravis_camera {
namespace {

using Layout = devices::PixelFormat;

// PFNC 2.4, table of values.
constexpr std::array kWireFormats{
    WireFormat{"Mono8", 0x01080001, Layout::mono, Packing::byte, 8},
    WireFormat{"Mono10", 0x01100003, Layout::mono, Packing::word, 10},
    WireFormat{"Mono10p", 0x010A0046, Layout::mono, Packing::lsb_10p, 10},
    WireFormat{"Mono12", 0x01100005, Layout::mono, Packing::word, 12},
    WireFormat{"Mono12p", 0x010C0047, Layout::mono, Packing::lsb_12p, 12},
    WireFormat{"Mono12Packed", 0x010C0006, Layout::mono, Packing::gev_12_packed, 12},
    WireFormat{"Mono16", 0x01100007, Layout::mono, Packing::word, 16},
    WireFormat{"BayerRG8", 0x01080009, Layout::bayer_rggb, Packing::byte, 8},
    WireFormat{"BayerRG10", 0x0110000D, Layout::bayer_rggb, Packing::word, 10},
    WireFormat{"BayerRG10p", 0x010A0058, Layout::bayer_rggb, Packing::lsb_10p, 10},
    WireFormat{"BayerRG12", 0x01100011, Layout::bayer_rggb, Packing::word, 12},
    WireFormat{"BayerRG12p", 0x010C0059, Layout::bayer_rggb, Packing::lsb_12p, 12},
    WireFormat{"BayerRG12Packed", 0x010C002B, Layout::bayer_rggb, Packing::gev_12_packed, 12},
    WireFormat{"BayerRG16", 0x0110002F, Layout::bayer_rggb, Packing::word, 16},
    WireFormat{"BayerGR8", 0x01080008, Layout::bayer_grbg, Packing::byte, 8},
    WireFormat{"BayerGR10", 0x0110000C, Layout::bayer_grbg, Packing::word, 10},
    WireFormat{"BayerGR10p", 0x010A0056, Layout::bayer_grbg, Packing::lsb_10p, 10},
    WireFormat{"BayerGR12", 0x01100010, Layout::bayer_grbg, Packing::word, 12},
    WireFormat{"BayerGR12p", 0x010C0057, Layout::bayer_grbg, Packing::lsb_12p, 12},
    WireFormat{"BayerGR12Packed", 0x010C002A, Layout::bayer_grbg, Packing::gev_12_packed, 12},
    WireFormat{"BayerGR16", 0x0110002E, Layout::bayer_grbg, Packing::word, 16},
    WireFormat{"BayerGB8", 0x0108000A, Layout::bayer_gbrg, Packing::byte, 8},
    WireFormat{"BayerGB10", 0x0110000E, Layout::bayer_gbrg, Packing::word, 10},
    WireFormat{"BayerGB10p", 0x010A0054, Layout::bayer_gbrg, Packing::lsb_10p, 10},
    WireFormat{"BayerGB12", 0x01100012, Layout::bayer_gbrg, Packing::word, 12},
    WireFormat{"BayerGB12p", 0x010C0055, Layout::bayer_gbrg, Packing::lsb_12p, 12},
    WireFormat{"BayerGB12Packed", 0x010C002C, Layout::bayer_gbrg, Packing::gev_12_packed, 12},
    WireFormat{"BayerGB16", 0x01100030, Layout::bayer_gbrg, Packing::word, 16},
    WireFormat{"BayerBG8", 0x0108000B, Layout::bayer_bggr, Packing::byte, 8},
    WireFormat{"BayerBG10", 0x0110000F, Layout::bayer_bggr, Packing::word, 10},
    WireFormat{"BayerBG10p", 0x010A0052, Layout::bayer_bggr, Packing::lsb_10p, 10},
    WireFormat{"BayerBG12", 0x01100013, Layout::bayer_bggr, Packing::word, 12},
    WireFormat{"BayerBG12p", 0x010C0053, Layout::bayer_bggr, Packing::lsb_12p, 12},
    WireFormat{"BayerBG12Packed", 0x010C002D, Layout::bayer_bggr, Packing::gev_12_packed, 12},
    WireFormat{"BayerBG16", 0x01100031, Layout::bayer_bggr, Packing::word, 16},
};

template <typename Matches>
const WireFormat* first_that(Matches matches) {
  const auto* const found = std::find_if(kWireFormats.begin(), kWireFormats.end(), matches);
  return found == kWireFormats.end() ? nullptr : found;
}

}  // namespace

std::span<const WireFormat> wire_formats() { return kWireFormats; }

const WireFormat* find_wire_format(std::string_view name) {
  return first_that([&](const WireFormat& format) { return format.name == name; });
}

const WireFormat* find_wire_format(std::uint32_t code) {
  return first_that([&](const WireFormat& format) { return format.code == code; });
}

std::size_t packed_size(Packing packing, std::size_t pixels) {
  switch (packing) {
    case Packing::byte:
      return pixels;
    case Packing::word:
      return 2 * pixels;
    case Packing::lsb_10p:
      return (10 * pixels + 7) / 8;
    case Packing::lsb_12p:
    case Packing::gev_12_packed:
      return (12 * pixels + 7) / 8;
  }
  return 0;
}

}  // namespace gonio::aravis_camera
