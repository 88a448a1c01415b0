#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <cstddef>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "gonio/aravis_camera/unpack.h"
#include "gonio/aravis_camera/wire_format.h"

namespace gonio::aravis_camera {
namespace {

using testing::ElementsAre;

std::vector<std::byte> bytes(std::initializer_list<unsigned> values) {
  std::vector<std::byte> out;
  for (const unsigned value : values) out.push_back(static_cast<std::byte>(value));
  return out;
}

std::vector<std::uint16_t> unpacked(Packing packing, const std::vector<std::byte>& packed,
                                    std::size_t pixels) {
  std::vector<std::uint16_t> dn(pixels, 0xFFFF);
  unpack(packing, packed, dn);
  return dn;
}

// The layouts as PFNC 2.4 draws them; each pixel has bits of its own to be recognised by.

TEST(Unpack, BytesAreValues) {
  EXPECT_THAT(unpacked(Packing::byte, bytes({0x00, 0x7F, 0xFF}), 3), ElementsAre(0, 127, 255));
}

TEST(Unpack, WordsAreLittleEndian) {
  EXPECT_THAT(unpacked(Packing::word, bytes({0x34, 0x12, 0xFF, 0x0F, 0xFF, 0xFF}), 3),
              ElementsAre(0x1234, 0x0FFF, 0xFFFF));
}

TEST(Unpack, TenBitsLieLowestFirstAcrossFiveBytes) {
  // PFNC 2.4, Mono10p: byte 0 = P0[7:0]; byte 1 = P1[5:0] P0[9:8]; byte 2 = P2[3:0] P1[9:6];
  // byte 3 = P3[1:0] P2[9:4]; byte 4 = P3[9:2].
  const unsigned p0 = 0x2A5;
  const unsigned p1 = 0x13C;
  const unsigned p2 = 0x3F1;
  const unsigned p3 = 0x0B6;
  EXPECT_THAT(unpacked(Packing::lsb_10p, bytes({0xA5, 0xF2, 0x14, 0xBF, 0x2D}), 4),
              ElementsAre(p0, p1, p2, p3));
}

TEST(Unpack, TwelveBitsLieLowestFirstAcrossThreeBytes) {
  // PFNC 2.4, Mono12p: byte 0 = P0[7:0]; byte 1 = P1[3:0] P0[11:8]; byte 2 = P1[11:4].
  EXPECT_THAT(unpacked(Packing::lsb_12p, bytes({0xBC, 0xFA, 0xDE}), 2), ElementsAre(0xABC, 0xDEF));
}

TEST(Unpack, TwelveBitsPackedHaveTheirLowHalvesInTheMiddleByte) {
  // GigE Vision, Mono12Packed: byte 0 = P0[11:4]; byte 1 = P1[3:0] P0[3:0]; byte 2 = P1[11:4].
  EXPECT_THAT(unpacked(Packing::gev_12_packed, bytes({0xAB, 0xFC, 0xDE}), 2),
              ElementsAre(0xABC, 0xDEF));
}

TEST(Unpack, OddNumbersOfPixelsUseHalfOfTheirLastByte) {
  EXPECT_THAT(unpacked(Packing::lsb_12p, bytes({0xBC, 0xFA, 0xDE, 0x23, 0x01}), 3),
              ElementsAre(0xABC, 0xDEF, 0x123));
  EXPECT_THAT(unpacked(Packing::gev_12_packed, bytes({0xAB, 0xFC, 0xDE, 0x12, 0x03}), 3),
              ElementsAre(0xABC, 0xDEF, 0x123));
  EXPECT_THAT(unpacked(Packing::lsb_10p, bytes({0xA5, 0x02}), 1), ElementsAre(0x2A5));
}

TEST(Unpack, NothingGivesNothing) {
  for (const Packing packing :
       {Packing::byte, Packing::word, Packing::lsb_10p, Packing::lsb_12p, Packing::gev_12_packed}) {
    EXPECT_TRUE(unpacked(packing, {}, 0).empty());
  }
}

TEST(Unpack, RefusesAnotherNumberOfBytes) {
  for (const Packing packing :
       {Packing::byte, Packing::word, Packing::lsb_10p, Packing::lsb_12p, Packing::gev_12_packed}) {
    const std::size_t right = packed_size(packing, 100);
    for (const std::size_t wrong : {right - 1, right + 1, std::size_t{0}}) {
      const std::vector<std::byte> packed(wrong);
      std::vector<std::uint16_t> dn(100);
      EXPECT_THROW(unpack(packing, packed, dn), std::invalid_argument);
      EXPECT_THROW(unpack_plain(packing, packed, dn), std::invalid_argument);
    }
  }
}

TEST(Unpack, FastLoopsGiveWhatThePlainOnesGiveAtEveryLength) {
  std::mt19937 random(7);
  for (const Packing packing : {Packing::lsb_12p, Packing::gev_12_packed}) {
    for (std::size_t pixels = 0; pixels < 200; ++pixels) {
      std::vector<std::byte> packed(packed_size(packing, pixels));
      for (std::byte& byte : packed) byte = static_cast<std::byte>(random());
      std::vector<std::uint16_t> fast(pixels);
      std::vector<std::uint16_t> plain(pixels);
      unpack(packing, packed, fast);
      unpack_plain(packing, packed, plain);
      ASSERT_EQ(fast, plain) << pixels;
    }
  }
}

TEST(Unpack, EveryTwelveBitValueComesOutInBothPlaces) {
  // Written with bytes put together by hand for the two layouts.
  for (unsigned value = 0; value < 4096; ++value) {
    const unsigned other = 4095 - value;
    EXPECT_THAT(unpacked(Packing::lsb_12p,
                         bytes({value % 256, value / 256 + other % 16 * 16, other / 16}), 2),
                ElementsAre(value, other));
    EXPECT_THAT(unpacked(Packing::gev_12_packed,
                         bytes({value / 16, value % 16 + other % 16 * 16, other / 16}), 2),
                ElementsAre(value, other));
  }
}

TEST(Unpack, BitsInUseAreThoseOfEveryPixelWhereverItLies) {
  EXPECT_EQ(bits_in_use({}), 0);
  for (std::size_t pixels = 1; pixels < 40; ++pixels) {
    for (std::size_t place = 0; place < pixels; ++place) {
      std::vector<std::uint16_t> dn(pixels, 0x0001);
      dn[place] = 0x8000;
      ASSERT_EQ(bits_in_use(dn), pixels == 1 ? 0x8000 : 0x8001) << place << " of " << pixels;
    }
  }
}

TEST(WireFormat, CodesSayTheirOwnSizeAndAreUnique) {
  std::set<std::uint32_t> codes;
  std::set<std::string_view> names;
  for (const WireFormat& format : wire_formats()) {
    EXPECT_TRUE(codes.insert(format.code).second) << format.name;
    EXPECT_TRUE(names.insert(format.name).second) << format.name;
    // PFNC: bits 16 to 23 of a code are the bits that a pixel takes.
    EXPECT_EQ(packed_size(format.packing, 8), (format.code >> 16 & 0xFFU)) << format.name;
    EXPECT_EQ(format.code >> 24, 1U) << format.name;  // one component
  }
}

TEST(WireFormat, IsFoundByNameAndByCode) {
  const WireFormat* const by_name = find_wire_format("BayerGB12p");
  ASSERT_NE(by_name, nullptr);
  EXPECT_EQ(by_name->code, 0x010C0055U);
  EXPECT_EQ(by_name->layout, devices::PixelFormat::bayer_gbrg);
  EXPECT_EQ(find_wire_format(0x010C0055U), by_name);
  EXPECT_EQ(find_wire_format("RGB8"), nullptr);
  EXPECT_EQ(find_wire_format(0x02180014U), nullptr);
}

}  // namespace
}  // namespace gonio::aravis_camera
