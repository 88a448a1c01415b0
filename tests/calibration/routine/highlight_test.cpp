// The lamp's image among pixels that have no value.

#include "highlight.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "gonio/calibration/result/step_refused.h"
#include "gonio/random/stream.h"

namespace gonio::calibration::routine {
namespace {

constexpr int kWidth = 160;
constexpr int kHeight = 120;
constexpr double kBlack_dn = 64.0;
constexpr double kRadius_px = 4.0;
constexpr std::uint16_t kFull_dn = 4095;
const Eigen::Vector2d kMiddle(80.3, 60.7);

/// A disc of `height_dn` with an edge as blurred as a good lens leaves it, and noise of 2 DN.
devices::Frame picture(double height_dn) {
  devices::Frame frame;
  frame.width_px = kWidth;
  frame.height_px = kHeight;
  frame.saturation_level_dn = kFull_dn;
  random::Stream noise(random::make_key(8, "highlight"));
  for (int row = 0; row < kHeight; ++row) {
    for (int column = 0; column < kWidth; ++column) {
      const double inside = kRadius_px - (Eigen::Vector2d(column, row) - kMiddle).norm();
      const double value = kBlack_dn + height_dn * 0.5 * std::erfc(-inside / 0.8);
      frame.pixels_dn.push_back(static_cast<std::uint16_t>(
          std::lround(std::clamp(value + 2.0 * noise.normal(), 0.0, double{kFull_dn}))));
    }
  }
  return frame;
}

std::size_t at(int row, int column) { return static_cast<std::size_t>(row * kWidth + column); }

Eigen::Vector2d centre_of(const devices::Frame& frame, const std::vector<std::uint8_t>& bad = {}) {
  return find_highlight(frame, bad, kBlack_dn, kRadius_px).value().pixel;
}

// Of a centre, by 2 DN of noise, and by a mean that stands for a pixel at the image's edge.
constexpr double kNoise_px = 0.015;

TEST(Highlight, PixelsOfTheMapDrawNoCentre) {
  devices::Frame frame = picture(2400.0);
  const Eigen::Vector2d clean = centre_of(frame);
  EXPECT_LT((clean - kMiddle).norm(), 0.03) << "what pixels that are cut by the edge leave";
  std::vector<std::uint8_t> bad(frame.pixels_dn.size(), 0);
  for (const std::size_t dead : {at(61, 82), at(58, 81)}) {  // in the image
    frame.pixels_dn[dead] = 64;
    bad[dead] = 1;
  }
  for (const std::size_t hot : {at(61, 86), at(66, 85), at(54, 88)}) {  // and around it
    frame.pixels_dn[hot] = 3500;
    bad[hot] = 2;
  }
  EXPECT_GT((centre_of(frame) - clean).norm(), 3.0 * kNoise_px) << "what the mask is for";
  EXPECT_LT((centre_of(frame, bad) - clean).norm(), kNoise_px);
}

TEST(Highlight, PixelsThatAreBrightAloneDrawNoneBeforeThereIsAMap) {
  devices::Frame frame = picture(2400.0);
  const Eigen::Vector2d clean = centre_of(frame);
  // Full ones beside the image, far from it and in it; a warm one just above what counts as image.
  for (const std::size_t hot : {at(67, 88), at(52, 70), at(10, 20), at(61, 81)}) {
    frame.pixels_dn[hot] = kFull_dn;
  }
  frame.pixels_dn[at(60, 92)] = 900;
  EXPECT_LT((centre_of(frame) - clean).norm(), kNoise_px);
}

TEST(Highlight, IsNoneWhereOnlyHotPixelsAre) {
  devices::Frame frame = picture(0.0);
  for (int i = 0; i < 20; ++i) frame.pixels_dn[at(10 + 5 * i, 15 + 6 * i)] = kFull_dn;
  EXPECT_FALSE(find_highlight(frame, {}, kBlack_dn, kRadius_px));
}

TEST(Highlight, ThatIsSaturatedIsRefused) {
  EXPECT_THAT([] { centre_of(picture(5000.0)); },
              testing::ThrowsMessage<StepRefused>(testing::HasSubstr("saturated")));
  devices::Frame tip = picture(2400.0);  // no more than its very top
  for (const std::size_t full : {at(60, 80), at(61, 80), at(60, 81)}) {
    tip.pixels_dn[full] = kFull_dn;
  }
  EXPECT_THROW(centre_of(tip), StepRefused);
}

TEST(WindowedSum, TakesItsNeighboursForABadPixel) {
  devices::Frame frame = picture(2400.0);
  const auto sum = [&](const std::vector<std::uint8_t>& bad) {
    return windowed_sum(frame, bad, kBlack_dn, kMiddle, kRadius_px);
  };
  const double clean = sum({});
  std::vector<std::uint8_t> bad(frame.pixels_dn.size(), 0);
  for (const std::size_t hot : {at(60, 85), at(62, 80)}) {
    frame.pixels_dn[hot] = kFull_dn;
    bad[hot] = 1;
  }
  EXPECT_GT(sum({}), 1.02 * clean);
  EXPECT_NEAR(sum(bad) / clean, 1.0, 0.005);
}

}  // namespace
}  // namespace gonio::calibration::routine
