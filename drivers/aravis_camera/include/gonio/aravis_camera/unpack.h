#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "gonio/aravis_camera/wire_format.h"

namespace gonio::aravis_camera {

/// Turns a camera's bytes into DN, one std::uint16_t per pixel, not shifted.
///
/// `packed`  As many bytes as packed_size() says for `dn.size()` pixels, else
///           std::invalid_argument.
/// Speed     The 12 bit packings go through AVX2 where the processor has it, with the same result.
/// Threads   Any.
void unpack(Packing packing, std::span<const std::byte> packed, std::span<std::uint16_t> dn);

/// The same on any processor: what unpack() is tested against.
void unpack_plain(Packing packing, std::span<const std::byte> packed, std::span<std::uint16_t> dn);

/// All bits that are set in any pixel: above the bits of the format when the bytes were swapped or
/// left-aligned. Costs less than reading the frame once more from memory.
std::uint16_t bits_in_use(std::span<const std::uint16_t> dn);

}  // namespace gonio::aravis_camera
