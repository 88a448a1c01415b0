#include "gonio/instrument/pixel_counts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "gonio/random/stream.h"

namespace gonio::instrument {
namespace {

std::vector<std::uint16_t> some_pixels(std::size_t count, std::uint64_t bound) {
  random::Stream stream(random::make_key(5, "pixel_counts_test"));
  std::vector<std::uint16_t> pixels(count);
  for (std::uint16_t& pixel : pixels) pixel = static_cast<std::uint16_t>(stream.below(bound));
  return pixels;
}

TEST(PixelCounts, GivesWhatSortingGives) {
  for (const std::uint64_t bound : {3U, 4096U, 65536U}) {
    const std::vector<std::uint16_t> pixels = some_pixels(1001, bound);
    const PixelCounts counts(pixels);
    std::vector<std::uint16_t> sorted = pixels;
    std::sort(sorted.begin(), sorted.end());
    for (std::size_t n = 0; n < sorted.size(); n += 10) {
      EXPECT_EQ(counts.nth_smallest(n), sorted[n]);
      EXPECT_EQ(counts.nth_largest(n), sorted[sorted.size() - 1 - n]);
    }
  }
}

TEST(PixelCounts, CountsWhatIsBrighterThanALevelBetweenValues) {
  const std::vector<std::uint16_t> pixels{0, 7, 7, 8, 65535};
  const PixelCounts counts(pixels);
  EXPECT_EQ(counts.above(-0.5), 5U);
  EXPECT_EQ(counts.above(0.0), 4U);
  EXPECT_EQ(counts.above(7.0), 2U);
  EXPECT_EQ(counts.above(6.9), 4U);
  EXPECT_EQ(counts.above(65535.0), 0U);
}

TEST(PixelCounts, RefusesAPlaceBeyondTheLast) {
  const std::vector<std::uint16_t> pixels{1, 2};
  EXPECT_THROW(PixelCounts(pixels).nth_smallest(2), std::out_of_range);
  EXPECT_THROW(PixelCounts(pixels).nth_largest(2), std::out_of_range);
}

}  // namespace
}  // namespace gonio::instrument
