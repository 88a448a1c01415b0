#include "gonio/calibration/sensor/level_statistics.h"

#include <gmock/gmock.h>

#include "refused.h"
#include "simple_sensor.h"

namespace gonio::calibration::sensor {
namespace {

using testing::HasSubstr;

TEST(LevelStatistics, TellsMeanAndTemporalVarianceOfAShadedScene) {
  SensorTruth truth;
  truth.prnu = 0.05;  // a fixed pattern ten times the shot noise must not matter
  SimpleSensor sensor(truth, 1);
  const LevelStatistics level = sensor.level(kHalfWell_s, kHalfWell_e_per_s);
  const double electrons = kHalfWell_s * kHalfWell_e_per_s;
  constexpr double kMean_e = 0.05 / 128.0;  // PRNU of the mean of 128 x 128 pixels
  EXPECT_NEAR(level.mean_dn.value, 64.0 + 0.39 * electrons, 4.0 * kMean_e * 0.39 * electrons);
  const double variance = 0.39 * 0.39 * (electrons + 2.4 * 2.4) + 1.0 / 12.0;
  EXPECT_NEAR(level.variance_dn2.value, variance, 4.0 * level.variance_dn2.sigma);
  // Of a normal variable; PRNU makes the pixels' variances differ by 5 % and adds 0.1 %.
  EXPECT_NEAR(level.variance_dn2.sigma, variance * std::sqrt(2.0) / 128.0, 0.05 * variance / 90.0);
}

TEST(LevelStatistics, LeavesMaskedPixelsAndTheRestOfTheImageOut) {
  SimpleSensor sensor({}, 2);
  OwnedFrame a = sensor.expose(kHalfWell_s, kHalfWell_e_per_s);
  OwnedFrame b = sensor.expose(kHalfWell_s, kHalfWell_e_per_s);
  const auto clean = level_statistics(a.view(), b.view(), {.region = {16, 16, 64, 64, 2}});
  EXPECT_EQ(clean.pixels, 32U * 32U);
  std::vector<std::uint8_t> mask(a.pixels_dn.size(), 0);
  mask[20 * 128 + 20] = 1;
  a.pixels_dn[20 * 128 + 20] = 4095;  // masked
  a.pixels_dn[5] = 4095;              // outside
  a.pixels_dn[21 * 128 + 21] = 4095;  // not of the colour
  const auto masked =
      level_statistics(a.view(), b.view(), {.region = {16, 16, 64, 64, 2}, .bad_pixels = mask});
  EXPECT_EQ(masked.pixels, 32U * 32U - 1U);
  EXPECT_EQ(masked.saturated_fraction, 0.0);
  EXPECT_NEAR(masked.variance_dn2.value, clean.variance_dn2.value,
              0.02 * clean.variance_dn2.value);  // one pixel less of 1024
}

TEST(LevelStatistics, TakesOutACommonStepOfTheLight) {
  SimpleSensor sensor({}, 3);
  const OwnedFrame a = sensor.expose(kHalfWell_s, kHalfWell_e_per_s);
  const OwnedFrame b = sensor.expose(kHalfWell_s, 1.01 * kHalfWell_e_per_s);
  const auto level = level_statistics(a.view(), b.view(), {});
  EXPECT_NEAR(level.mean_difference_dn, 0.01 * 0.39 * 4500.0, 1.0);
  const double variance = 0.39 * 0.39 * (4500.0 * 1.005 + 2.4 * 2.4) + 1.0 / 12.0;
  EXPECT_NEAR(level.variance_dn2.value, variance, 4.0 * level.variance_dn2.sigma);
}

TEST(LevelStatistics, RefusesPairsThatAreNone) {
  SimpleSensor sensor({}, 4);
  const OwnedFrame a = sensor.expose(kHalfWell_s, kHalfWell_e_per_s);
  OwnedFrame other = sensor.expose(kHalfWell_s, kHalfWell_e_per_s);
  EXPECT_THAT(refusal([&] { level_statistics(a.view(), a.view(), {}); }),
              HasSubstr("the same in every pixel"));
  other.width_px = 64;
  other.height_px = 256;
  EXPECT_THAT(refusal([&] { level_statistics(a.view(), other.view(), {}); }),
              HasSubstr("frames of 128 x 128 and 64 x 256"));
  other.width_px = 65;
  EXPECT_THAT(refusal([&] { level_statistics(other.view(), other.view(), {}); }),
              HasSubstr("65 x 256 has 16384 pixels"));
  const OwnedFrame longer = sensor.expose(0.019, kHalfWell_e_per_s);
  EXPECT_THAT(refusal([&] { level_statistics(a.view(), longer.view(), {}); }),
              HasSubstr("exposures of 0.018 and 0.019 s"));
  OwnedFrame timeless = a;
  timeless.exposure_s = std::nan("");
  EXPECT_THAT(refusal([&] { level_statistics(timeless.view(), timeless.view(), {}); }),
              HasSubstr("a frame of nan s"));
  EXPECT_THAT(refusal([&] {
                level_statistics(a.view(), sensor.expose(kHalfWell_s, kHalfWell_e_per_s).view(),
                                 {.region = {0, 0, 10, 10, 1}});
              }),
              HasSubstr("100 good pixels"));
  EXPECT_THROW(level_statistics(a.view(), a.view(), {.region = {100, 0, 64, 0, 1}}),
               std::invalid_argument);
  EXPECT_THROW(level_statistics(a.view(), a.view(), {.region = {-1, 0, 64, 0, 1}}),
               std::invalid_argument);
}

TEST(LevelStatistics, RefusesASceneThatChanged) {
  SimpleSensor sensor({}, 5);
  const OwnedFrame a = sensor.expose(kHalfWell_s, kHalfWell_e_per_s);
  const OwnedFrame brighter = sensor.expose(kHalfWell_s, 1.05 * kHalfWell_e_per_s);
  EXPECT_THAT(refusal([&] { level_statistics(a.view(), brighter.view(), {}); }),
              HasSubstr("the mean went from"));
  // Something small moved: the mean of all stays within 2 %.
  const OwnedFrame moved = sensor.expose(kHalfWell_s, kHalfWell_e_per_s, [](std::size_t p) {
    return p % 128 < 20 && p / 128 < 20 ? 0.5 : 1.0;
  });
  EXPECT_THAT(refusal([&] { level_statistics(a.view(), moved.view(), {}); }),
              HasSubstr("a part of the scene changed"));
}

}  // namespace
}  // namespace gonio::calibration::sensor
