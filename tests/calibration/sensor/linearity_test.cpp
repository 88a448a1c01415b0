#include "gonio/calibration/sensor/linearity.h"

#include <gmock/gmock.h>

#include <array>

#include "gonio/errors/errors.h"
#include "refused.h"
#include "simple_sensor.h"

namespace gonio::calibration::sensor {
namespace {

using testing::HasSubstr;

constexpr std::array<double, 2> kDarks_s{50e-6, 0.02};

/// 50 us, then doubling to where the level is a tenth, then evenly to 92 % of the 12 bits.
std::vector<LevelStatistics> long_sweep(SimpleSensor& sensor) {
  constexpr double kLight_e_per_s = 4.7e5;
  std::vector<LevelStatistics> levels;
  for (double t = 50e-6; t < 1.5e-3; t *= 2.0) levels.push_back(sensor.level(t, kLight_e_per_s));
  for (int k = 1; k <= 20; ++k) levels.push_back(sensor.level(0.001 + 0.0009 * k, kLight_e_per_s));
  std::sort(levels.begin(), levels.end(),
            [](const auto& a, const auto& b) { return a.exposure_s < b.exposure_s; });
  return levels;
}

SensorTruth bent_truth() {
  SensorTruth truth;
  truth.full_well_e = 10500.0;
  truth.nonlinearity = 0.003;
  truth.shutter_offset_s = 3e-6;
  return truth;
}

TEST(Linearity, FindsShutterOffsetAndBend) {
  SimpleSensor sensor(bent_truth(), 21);
  const auto result = fit_linearity(sensor.dark_levels(kDarks_s), long_sweep(sensor), {});
  EXPECT_TRUE(result.acceptance.passed());
  EXPECT_LT(result.le_percent, 0.3);
  constexpr double kOffset_s = 0.5e-6;  // of 3 us; 0.24 DN at this light
  EXPECT_NEAR(result.shutter_offset_s.value, 3e-6, kOffset_s);
  EXPECT_LT(result.shutter_offset_s.sigma, kOffset_s);
  EXPECT_LT(result.after_curve_percent, 0.05);
  // Three quarters up, y (1 - 0.003 (y / 4095)^2) has lost 5.2 DN, as the level at black none.
  const double straight = 0.75 * 4095.0;
  const double lost = 0.003 * 0.75 * 0.75 * straight;
  const double measured = straight - lost - 64.0;
  EXPECT_NEAR(result.curve.linear_dn(measured), straight - 64.0, 0.25 * lost);
}

TEST(Linearity, SigmasCoverTheTruth) {
  constexpr int kDraws = 200;
  SensorTruth truth = bent_truth();
  truth.width_px = truth.height_px = 24;
  truth.nonlinearity = 0.0;
  truth.prnu = 0.0;
  int offset_inside = 0;
  int curve_inside = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    SimpleSensor sensor(truth, 3000 + static_cast<std::uint64_t>(draw));
    const auto result =
        fit_linearity(sensor.dark_levels(kDarks_s), long_sweep(sensor), {.light_sigma = 0.0});
    if (std::abs(result.shutter_offset_s.value - 3e-6) <= 2.0 * result.shutter_offset_s.sigma) {
      ++offset_inside;
    }
    if (std::abs(result.curve.c1) <= 2.0 * std::sqrt(result.covariance(2, 2))) ++curve_inside;
  }
  expect_coverage(offset_inside, kDraws);
  expect_coverage(curve_inside, kDraws);
}

TEST(Linearity, FailsAGamma) {
  SensorTruth truth = bent_truth();
  truth.gamma = 2.2;
  SimpleSensor sensor(truth, 22);
  const auto result = fit_linearity(sensor.dark_levels(kDarks_s), long_sweep(sensor), {});
  EXPECT_FALSE(result.acceptance.passed());
  EXPECT_GT(result.le_percent, 5.0);
}

TEST(Linearity, OneTermHoldsAWeakBendToo) {
  SimpleSensor sensor(bent_truth(), 23);
  const auto levels = long_sweep(sensor);
  const auto result = fit_linearity(sensor.dark_levels(kDarks_s), levels, {.correction_terms = 1});
  EXPECT_EQ(result.curve.c2, 0.0);
  EXPECT_LT(result.after_curve_percent, 0.1);
  EXPECT_THROW(fit_linearity(levels, levels, {.correction_terms = 3}), std::invalid_argument);
}

TEST(Linearity, RefusesASweepThatIsNone) {
  SimpleSensor sensor(bent_truth(), 24);
  const auto dark = sensor.dark_levels(kDarks_s);
  const auto good = long_sweep(sensor);
  const auto refused = [&](const std::vector<LevelStatistics>& levels) {
    return refusal([&] { fit_linearity(dark, levels, {}); });
  };
  EXPECT_EQ(refused(good), "");
  auto swapped = good;
  std::swap(swapped[3], swapped[4]);
  EXPECT_THAT(refused(swapped), HasSubstr("expected rising exposures"));
  auto late = good;  // the camera applied the exposure one frame late
  std::swap(late[10].exposure_s, late[11].exposure_s);
  std::swap(late[10], late[11]);
  EXPECT_THAT(refused(late), HasSubstr("the signal falls"));
  EXPECT_THAT(refused(dark), HasSubstr("lamp is off"));
  EXPECT_THAT(refused({good.begin(), good.begin() + 9}), HasSubstr("take more exposures"));
  std::vector<LevelStatistics> full;
  for (int k = 0; k < 12; ++k) full.push_back(sensor.level(0.03 + 0.001 * k, 1e6));
  EXPECT_THAT(refused(full), HasSubstr("(12 saturated)"));
}

}  // namespace
}  // namespace gonio::calibration::sensor
