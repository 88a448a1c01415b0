#include "gonio/calibration/radiometry/stray_light.h"

#include <gmock/gmock.h>

#include "gonio/calibration/result/step_refused.h"
#include "white_scene.h"

namespace gonio::calibration {
namespace {

/// A trap that shows `fraction` of what a perfect white would under normal incidence at 500 mm.
std::vector<WhiteView> trap(const std::vector<double>& fractions) {
  random::Stream noise(random::make_key(5, "trap"));
  std::vector<WhiteView> views;
  for (const double fraction : fractions) {
    WhiteView view{joints_deg(60, 10.0 * static_cast<double>(views.size()), 0), 1, 0.8, {}};
    const double white = kConstant[1] * 0.8 / std::numbers::pi / (500.0 * 500.0);
    for (int i = 0; i < 400; ++i) {
      const double sigma = 2e-4 * white;
      view.pixels.push_back({160.0, 128.0, white * fraction + sigma * noise.normal(), sigma});
    }
    views.push_back(view);
  }
  return views;
}

TEST(StrayLight, IsAFractionOfTheWhite) {
  const StrayLight stray =
      stray_light(true_instrument(), kConstant, trap({0.0005, 0.0005, 0.0005, 0.0005}));
  EXPECT_NEAR(stray.fraction, 0.0005, 3.0 * stray.sigma);
  EXPECT_LT(stray.sigma, 1e-5);
  EXPECT_LT(stray.spread, 1e-5);
}

TEST(StrayLight, SpreadFromPoseToPoseIsSeen) {
  const StrayLight stray =
      stray_light(true_instrument(), kConstant, trap({0.0003, 0.0005, 0.0007, 0.0005}));
  EXPECT_NEAR(stray.spread, 0.000163, 0.00002);
  EXPECT_EQ(stray.worst_view, 2);
}

TEST(StrayLight, ReflectionBesideTheTrapIsRefusedByItsPose) {
  EXPECT_THAT(
      [] {
        stray_light(true_instrument(), kConstant, trap({0.0005, 0.0005, 0.004}));
      },
      testing::ThrowsMessage<StepRefused>(
          testing::AllOf(testing::HasSubstr("view 2"), testing::HasSubstr("0.400 %"))));
}

TEST(StrayLight, NeedsTheConstantOfItsChannel) {
  EXPECT_THAT(
      [] {
        stray_light(true_instrument(), {1e9, 0.0, 1e9}, trap({0.0005}));
      },
      testing::ThrowsMessage<StepRefused>(testing::HasSubstr("white first")));
}

}  // namespace
}  // namespace gonio::calibration
