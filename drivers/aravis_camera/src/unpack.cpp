#include "gonio/aravis_camera/unpack.h"

#include <array>
#include <bit>
#include <cstring>
#include <stdexcept>
#include <string>

#if defined(__x86_64__) && defined(__GNUC__)
#include <immintrin.h>
#define GONIO_UNPACK_AVX2 1
#else
#define GONIO_UNPACK_AVX2 0
#endif

namespace gonio::aravis_camera {
namespace {

static_assert(std::endian::native == std::endian::little, "words are copied as they come");

unsigned at(std::span<const std::byte> bytes, std::size_t index) {
  return std::to_integer<unsigned>(bytes[index]);
}

void require_size(Packing packing, std::span<const std::byte> packed, std::span<std::uint16_t> dn) {
  const std::size_t expected = packed_size(packing, dn.size());
  if (packed.size() != expected) {
    throw std::invalid_argument("packed pixels: found " + std::to_string(packed.size()) +
                                " bytes, expected " + std::to_string(expected));
  }
}

void unpack_10p(std::span<const std::byte> packed, std::span<std::uint16_t> dn) {
  for (std::size_t pixel = 0; pixel < dn.size(); ++pixel) {
    const std::size_t first = pixel * 10 / 8;
    const unsigned shift = pixel * 10 % 8;  // 0, 2, 4 or 6: always two bytes
    const unsigned word = at(packed, first) | at(packed, first + 1) << 8;
    dn[pixel] = static_cast<std::uint16_t>(word >> shift & 0x3FFU);
  }
}

/// From pixel `begin`, which is even, to the end.
void unpack_12p(std::span<const std::byte> packed, std::span<std::uint16_t> dn, std::size_t begin) {
  for (std::size_t pixel = begin; pixel < dn.size(); ++pixel) {
    const std::size_t first = pixel / 2 * 3 + pixel % 2;
    const unsigned word = at(packed, first) | at(packed, first + 1) << 8;
    dn[pixel] = static_cast<std::uint16_t>(pixel % 2 == 0 ? word & 0xFFFU : word >> 4);
  }
}

/// From pixel `begin`, which is even, to the end.
void unpack_gev_12(std::span<const std::byte> packed, std::span<std::uint16_t> dn,
                   std::size_t begin) {
  for (std::size_t pixel = begin; pixel < dn.size(); ++pixel) {
    const std::size_t pair = pixel / 2 * 3;
    const unsigned low = at(packed, pair + 1);
    dn[pixel] = static_cast<std::uint16_t>(pixel % 2 == 0 ? at(packed, pair) << 4 | (low & 0xFU)
                                                          : at(packed, pair + 2) << 4 | low >> 4);
  }
}

#if GONIO_UNPACK_AVX2
bool has_avx2() {
  static const bool has = __builtin_cpu_supports("avx2") != 0;
  return has;
}

// 16 pixels in 24 bytes at a time: 12 bytes in each half of a register, of which 16 are loaded.
constexpr std::size_t kPixelsPerStep = 16;
constexpr std::size_t kBytesPerStep = 24;
constexpr std::size_t kBytesLoaded = 28;

std::size_t whole_steps(std::size_t bytes) {
  return bytes < kBytesLoaded ? 0 : (bytes - kBytesLoaded) / kBytesPerStep + 1;
}

__attribute__((target("avx2"))) inline __m256i load_halves(const std::byte* bytes) {
  const __m128i low = _mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes));
  const __m128i high = _mm_loadu_si128(reinterpret_cast<const __m128i*>(bytes + kBytesPerStep / 2));
  return _mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1);
}

/// Returns the pixels done.
__attribute__((target("avx2"))) std::size_t unpack_12p_avx2(std::span<const std::byte> packed,
                                                            std::span<std::uint16_t> dn) {
  // Word of an even pixel: bytes 0 and 1 of its three, of an odd one: 1 and 2.
  const __m256i places = _mm256_setr_epi8(0, 1, 1, 2, 3, 4, 4, 5, 6, 7, 7, 8, 9, 10, 10, 11,  //
                                          0, 1, 1, 2, 3, 4, 4, 5, 6, 7, 7, 8, 9, 10, 10, 11);
  const __m256i twelve = _mm256_set1_epi16(0x0FFF);
  const std::size_t steps = whole_steps(packed.size());
  for (std::size_t step = 0; step < steps; ++step) {
    const __m256i words =
        _mm256_shuffle_epi8(load_halves(packed.data() + step * kBytesPerStep), places);
    const __m256i even = _mm256_and_si256(words, twelve);
    const __m256i odd = _mm256_srli_epi16(words, 4);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(dn.data() + step * kPixelsPerStep),
                        _mm256_blend_epi16(even, odd, 0xAA));
  }
  return steps * kPixelsPerStep;
}

/// Returns the pixels done.
__attribute__((target("avx2"))) std::size_t unpack_gev_12_avx2(std::span<const std::byte> packed,
                                                               std::span<std::uint16_t> dn) {
  // The byte with the low halves below the pixel's own.
  const __m256i places = _mm256_setr_epi8(1, 0, 1, 2, 4, 3, 4, 5, 7, 6, 7, 8, 10, 9, 10, 11,  //
                                          1, 0, 1, 2, 4, 3, 4, 5, 7, 6, 7, 8, 10, 9, 10, 11);
  const __m256i high_byte = _mm256_set1_epi16(0x0FF0);
  const __m256i low_half = _mm256_set1_epi16(0x000F);
  const std::size_t steps = whole_steps(packed.size());
  for (std::size_t step = 0; step < steps; ++step) {
    const __m256i words =
        _mm256_shuffle_epi8(load_halves(packed.data() + step * kBytesPerStep), places);
    const __m256i odd = _mm256_srli_epi16(words, 4);
    const __m256i even =
        _mm256_or_si256(_mm256_and_si256(odd, high_byte), _mm256_and_si256(words, low_half));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(dn.data() + step * kPixelsPerStep),
                        _mm256_blend_epi16(even, odd, 0xAA));
  }
  return steps * kPixelsPerStep;
}
#endif

}  // namespace

void unpack_plain(Packing packing, std::span<const std::byte> packed, std::span<std::uint16_t> dn) {
  require_size(packing, packed, dn);
  switch (packing) {
    case Packing::byte:
      for (std::size_t pixel = 0; pixel < dn.size(); ++pixel) {
        dn[pixel] = static_cast<std::uint16_t>(at(packed, pixel));
      }
      return;
    case Packing::word:
      if (!dn.empty()) std::memcpy(dn.data(), packed.data(), packed.size());
      return;
    case Packing::lsb_10p:
      return unpack_10p(packed, dn);
    case Packing::lsb_12p:
      return unpack_12p(packed, dn, 0);
    case Packing::gev_12_packed:
      return unpack_gev_12(packed, dn, 0);
  }
}

void unpack(Packing packing, std::span<const std::byte> packed, std::span<std::uint16_t> dn) {
#if GONIO_UNPACK_AVX2
  if (has_avx2() && (packing == Packing::lsb_12p || packing == Packing::gev_12_packed)) {
    require_size(packing, packed, dn);
    if (packing == Packing::lsb_12p) {
      return unpack_12p(packed, dn, unpack_12p_avx2(packed, dn));
    }
    return unpack_gev_12(packed, dn, unpack_gev_12_avx2(packed, dn));
  }
#endif
  unpack_plain(packing, packed, dn);
}

std::uint16_t bits_in_use(std::span<const std::uint16_t> dn) {
  // Sixteen pixels a step, which the memory's speed limits.
  std::array<std::uint64_t, 4> four{};
  std::uint64_t together = 0;
  std::size_t pixel = 0;
  for (; pixel + 16 <= dn.size(); pixel += 16) {
    std::memcpy(four.data(), dn.data() + pixel, sizeof four);
    together |= (four[0] | four[1]) | (four[2] | four[3]);
  }
  for (; pixel < dn.size(); ++pixel) together |= dn[pixel];
  return static_cast<std::uint16_t>(together | together >> 16 | together >> 32 | together >> 48);
}

}  // namespace gonio::aravis_camera
