#include "gonio/calibration/sensor/pixel_stack.h"

#include <gmock/gmock.h>

#include <limits>

#include "refused.h"

namespace gonio::calibration::sensor {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kSaturation_dn = 65535.0;

FrameView view(const std::vector<std::uint16_t>& pixels, double exposure_s = 0.1) {
  return {pixels, 2, 2, exposure_s};
}

TEST(PixelStack, GivesMeanAndVarianceOfEachPixel) {
  PixelStack stack(2, 2, 0.1, kSaturation_dn);
  const std::vector<std::uint16_t> a{1, 60000, 7, 100};
  const std::vector<std::uint16_t> b{3, 60001, 7, 104};
  const std::vector<std::uint16_t> c{5, 60005, 7, 96};
  for (const auto* frame : {&a, &b, &c}) stack.add(view(*frame));
  EXPECT_EQ(stack.frames(), 3U);
  EXPECT_DOUBLE_EQ(stack.mean_dn(0), 3.0);
  EXPECT_DOUBLE_EQ(stack.variance_dn2(0), 4.0);
  EXPECT_DOUBLE_EQ(stack.mean_dn(1), 60002.0);
  EXPECT_DOUBLE_EQ(stack.variance_dn2(1), 7.0);  // (4 + 1 + 9) / 2: nothing cancels at 60000
  EXPECT_DOUBLE_EQ(stack.variance_dn2(2), 0.0);
  EXPECT_DOUBLE_EQ(stack.variance_dn2(3), 16.0);
  EXPECT_THAT(stack.frame_means_dn(), ElementsAre(15027.0, 15028.75, 15028.25));
}

TEST(PixelStack, RefusesForeignFramesAndStaysAsItWas) {
  PixelStack stack(2, 2, 0.1, 4095.0);
  const std::vector<std::uint16_t> good{1, 2, 3, 4};
  stack.add(view(good));
  EXPECT_THAT(refusal([&] { stack.add(view(good)); }), HasSubstr("delivered one twice"));
  EXPECT_THAT(refusal([&] { stack.add(view(good, 0.2)); }), HasSubstr("a frame of 0.2 s"));
  const std::vector<std::uint16_t> full{1, 2, 3, 4095};
  EXPECT_THAT(refusal([&] { stack.add(view(full)); }), HasSubstr("25.0 % of the pixels"));
  EXPECT_THAT(refusal([&] { stack.add({good, 4, 1, 0.1}); }), HasSubstr("a frame of 4 x 1"));
  EXPECT_THAT(refusal([&] { stack.add({good, 2, 3, 0.1}); }), HasSubstr("has 4 pixels"));
  EXPECT_THAT(refusal([&] { stack.add({good, -2, -2, 0.1}); }), HasSubstr("-2 x -2"));
  EXPECT_EQ(stack.frames(), 1U);
  EXPECT_DOUBLE_EQ(stack.mean_dn(3), 4.0);
  EXPECT_THROW(PixelStack(0, 2, 0.1, 4095.0), std::invalid_argument);
  EXPECT_THROW(PixelStack(2, 70000, 0.1, 4095.0), std::invalid_argument);
  EXPECT_THROW(PixelStack(2, 2, std::numeric_limits<double>::infinity(), 4095.0),
               std::invalid_argument);
}

}  // namespace
}  // namespace gonio::calibration::sensor
