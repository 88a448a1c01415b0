#include "gonio/monitor/frame_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

namespace gonio::monitor {
namespace {

constexpr std::uint16_t kSaturation_dn = 4000;
const render::Rgba8 kRed{230, 30, 30, 255};

devices::Frame frame_of(int width, int height, std::uint16_t dn) {
  devices::Frame frame;
  frame.width_px = width;
  frame.height_px = height;
  frame.saturation_level_dn = kSaturation_dn;
  frame.black_level_dn = 100.0;
  frame.pixels_dn.assign(static_cast<std::size_t>(width * height), dn);
  return frame;
}

/// Stripes whose edges are blurred over so many pixels.
devices::Frame stripes(double blur_px, double light) {
  devices::Frame frame = frame_of(64, 64, 0);
  for (int y = 0; y < 64; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double level = 0.5 + 0.4 * std::tanh(8.0 / blur_px * std::sin(x * 0.4));
      frame.pixels_dn[static_cast<std::size_t>(y * 64 + x)] =
          static_cast<std::uint16_t>(std::lround(100.0 + light * level));
    }
  }
  return frame;
}

TEST(FrameFigures, CountEveryPixelOnceAndTheSaturatedOnesInTheLastBin) {
  devices::Frame frame = frame_of(10, 10, 200);
  for (int i = 0; i < 7; ++i) frame.pixels_dn[static_cast<std::size_t>(i)] = kSaturation_dn;
  frame.pixels_dn[99] = 0;
  const FrameFigures figures = figures_of(frame);
  EXPECT_EQ(std::accumulate(figures.histogram.begin(), figures.histogram.end(), 0U), 100U);
  EXPECT_EQ(figures.histogram.back(), 7U);
  EXPECT_EQ(figures.histogram.front(), 1U);
  EXPECT_DOUBLE_EQ(figures.saturated_share, 0.07);
  EXPECT_DOUBLE_EQ(figures.mean_dn, (7 * 4000.0 + 92 * 200.0) / 100.0);
  EXPECT_EQ(figures.max_dn, kSaturation_dn);
  EXPECT_EQ(figures.min_dn, 0);
}

TEST(FrameFigures, SurviveAFrameWithoutASaturationLevel) {
  devices::Frame frame = frame_of(4, 4, 65535);
  frame.saturation_level_dn = 0;
  EXPECT_EQ(figures_of(frame).histogram.back(), 16U);
}

TEST(FramePicture, ShrinksAndMarksEvenOneSaturatedPixel) {
  devices::Frame frame = frame_of(1000, 300, 100);
  frame.pixels_dn[1000 * 299 + 999] = kSaturation_dn;
  const render::Image image = frame_picture(frame, 512);
  EXPECT_EQ(image.width(), 500);
  EXPECT_EQ(image.height(), 150);
  EXPECT_EQ(image.at(0, 0), (render::Rgba8{0, 0, 0, 255})) << "black level";
  EXPECT_EQ(image.at(499, 149), kRed);
  EXPECT_NE(image.at(498, 149), kRed);
}

TEST(FramePicture, ShowsAQuarterOfTheRangeAtHalfBrightness) {
  EXPECT_NEAR(frame_picture(frame_of(5, 5, 1075), 512).at(4, 4).g, 127.5, 0.6);
}

TEST(RegionClipped, KeepsToTheFrame) {
  const devices::Frame frame = frame_of(40, 30, 0);
  EXPECT_EQ(clipped({5, 6, 7, 8}, frame), (Region{5, 6, 7, 8}));
  EXPECT_EQ(clipped({-5, 20, 10, 100}, frame), (Region{0, 20, 5, 10}));
  const Region whole{0, 0, 40, 30};
  EXPECT_EQ(clipped({}, frame), whole);
  constexpr int kLow = std::numeric_limits<int>::min();
  constexpr int kHigh = std::numeric_limits<int>::max();
  EXPECT_EQ(clipped({kHigh, kHigh, kHigh, kHigh}, frame), whole);
  EXPECT_EQ(clipped({kLow, kLow, kHigh, kHigh}, frame), whole);
  EXPECT_EQ(clipped({0, 0, kLow, kLow}, frame), whole);
}

TEST(Focus, IsLargestWhereTheImageIsSharpestAndDoesNotFollowTheLight) {
  const Region whole{0, 0, 64, 64};
  double last = focus_of(stripes(1.0, 3000.0), whole);
  for (const double blur_px : {3.0, 6.0, 12.0, 24.0}) {
    const double now = focus_of(stripes(blur_px, 3000.0), whole);
    EXPECT_LT(now, last) << blur_px;
    last = now;
  }
  constexpr double kRounding = 0.02;  // of values in whole DN
  EXPECT_NEAR(focus_of(stripes(6.0, 1000.0), whole) / focus_of(stripes(6.0, 3000.0), whole), 1.0,
              kRounding);
}

TEST(Focus, IsNothingWithoutLightOrPixels) {
  EXPECT_EQ(focus_of(frame_of(20, 20, 90), {0, 0, 20, 20}), 0.0);
  EXPECT_EQ(focus_of(stripes(1.0, 3000.0), {0, 0, 2, 2}), 0.0);
}

}  // namespace
}  // namespace gonio::monitor
