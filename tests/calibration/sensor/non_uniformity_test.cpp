#include "gonio/calibration/sensor/non_uniformity.h"

#include <gmock/gmock.h>

#include "refused.h"
#include "simple_sensor.h"

namespace gonio::calibration::sensor {
namespace {

using testing::HasSubstr;

/// A lens that loses 15 % to the corner.
double shading(std::size_t p) {
  const double x = static_cast<double>(p % 128) / 64.0 - 1.0;
  const double y = static_cast<double>(p / 128) / 64.0 - 1.0;
  return 1.0 - 0.075 * (x * x + y * y);
}

TEST(NonUniformity, FindsDsnuAndPrnuUnderShading) {
  SimpleSensor sensor({}, 51);
  const auto found = fit_non_uniformity(sensor.stack(16, kHalfWell_s, 0.0),
                                        sensor.stack(16, kHalfWell_s, kHalfWell_e_per_s, shading));
  constexpr double kTolerance = 0.05;  // of the specification, 3.8
  EXPECT_NEAR(found.dsnu_dn.value / (1.2 * 0.39), 1.0, kTolerance);
  EXPECT_NEAR(found.prnu.value / 0.006, 1.0, kTolerance);
  EXPECT_LT(found.dsnu_dn.sigma, 0.02 * found.dsnu_dn.value);
  EXPECT_LT(found.prnu.sigma, 0.02 * found.prnu.value);
}

TEST(NonUniformity, LightThatWandersIsNoPrnu) {
  SimpleSensor sensor({}, 52);
  PixelStack bright(128, 128, kHalfWell_s, SimpleSensor::kTop_dn);
  for (int f = 0; f < 16; ++f) {
    const double wander = f % 2 == 0 ? 0.995 : 1.005;
    bright.add(sensor.expose(kHalfWell_s, wander * kHalfWell_e_per_s).view());
  }
  const auto found = fit_non_uniformity(sensor.stack(16, kHalfWell_s, 0.0), bright);
  EXPECT_NEAR(found.prnu.value / 0.006, 1.0, 0.05);
}

TEST(NonUniformity, SigmasCoverTheTruth) {
  constexpr int kDraws = 200;
  SensorTruth truth;
  truth.width_px = truth.height_px = 32;
  int dsnu_inside = 0;
  int prnu_inside = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    SimpleSensor sensor(truth, 7000 + static_cast<std::uint64_t>(draw));
    const auto found = fit_non_uniformity(sensor.stack(8, kHalfWell_s, 0.0),
                                          sensor.stack(8, kHalfWell_s, kHalfWell_e_per_s));
    if (std::abs(found.dsnu_dn.value - 1.2 * 0.39) <= 2.0 * found.dsnu_dn.sigma) ++dsnu_inside;
    if (std::abs(found.prnu.value - 0.006) <= 2.0 * found.prnu.sigma) ++prnu_inside;
  }
  expect_coverage(dsnu_inside, kDraws);
  expect_coverage(prnu_inside, kDraws);
}

TEST(NonUniformity, RefusesWhatItCannotTell) {
  SimpleSensor sensor({}, 53);
  const PixelStack dark = sensor.stack(8, kHalfWell_s, 0.0);
  const PixelStack bright = sensor.stack(8, kHalfWell_s, kHalfWell_e_per_s);
  EXPECT_EQ(refusal([&] { fit_non_uniformity(dark, bright); }), "");
  EXPECT_THAT(refusal([&] { fit_non_uniformity(bright, dark); }), HasSubstr("lamp is off"));
  EXPECT_THAT(refusal([&] { fit_non_uniformity(dark, sensor.stack(7, kHalfWell_s, 1e5)); }),
              HasSubstr("7 bright frames"));
  EXPECT_THAT(refusal([&] { fit_non_uniformity(dark, sensor.stack(8, 0.01, 1e5)); }),
              HasSubstr("take both alike"));
  PixelStack drifting = bright;
  drifting.add(sensor.expose(kHalfWell_s, 1.03 * kHalfWell_e_per_s).view());
  EXPECT_THAT(refusal([&] { fit_non_uniformity(dark, drifting); }), HasSubstr("warm up"));
}

}  // namespace
}  // namespace gonio::calibration::sensor
