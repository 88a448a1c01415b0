#include "gonio/calibration/sensor/darks.h"

#include <gmock/gmock.h>

#include "refused.h"
#include "simple_sensor.h"

namespace gonio::calibration::sensor {
namespace {

using testing::HasSubstr;

std::vector<PixelStack> dark_stacks(SimpleSensor& sensor, int frames = 16) {
  std::vector<PixelStack> stacks;
  for (const double exposure : {1e-4, 1.0, 2.0}) {
    stacks.push_back(sensor.stack(frames, exposure, 0.0));
  }
  return stacks;
}

SensorTruth spread_truth() {
  SensorTruth truth;
  truth.dark_current_spread = 0.2;
  return truth;
}

TEST(Darks, FindOffsetCurrentAndNoise) {
  SimpleSensor sensor(spread_truth(), 41);
  const Darks darks = fit_darks(dark_stacks(sensor), {.gain_dn_per_e = 0.39});
  constexpr double kCurrent = 0.05;  // tolerances of the specification, 3.8
  constexpr double kNoise = 0.03;
  EXPECT_NEAR(darks.black_level_dn.value, 64.0, 0.02);
  EXPECT_NEAR(darks.dark_current_dn_per_s.value / (5.0 * 0.39), 1.0, kCurrent);
  // Read noise with rounding: hypot(2.4 * 0.39, 0.2887) DN.
  EXPECT_NEAR(darks.temporal_noise_dn.value / 0.97949, 1.0, kNoise);
  // The two ways to the dark current, in electrons.
  const double by_mean = darks.mean_rate_dn_per_s.value / 0.39;
  const double by_variance = darks.variance_rate_dn2_per_s.value / (0.39 * 0.39);
  EXPECT_NEAR(by_variance / by_mean, 1.0, kCurrent);
  for (const instrument::AcceptanceCheck& acceptance : darks.acceptance) {
    EXPECT_TRUE(acceptance.passed()) << acceptance.name << " " << acceptance.found;
  }
}

TEST(Darks, MapsFollowThePixels) {
  SimpleSensor sensor(spread_truth(), 42);
  const Darks darks = fit_darks(dark_stacks(sensor), {});
  double current_error = 0.0;
  double noise_error = 0.0;
  double explained = 0.0;
  const auto pixels = static_cast<double>(sensor.pixels());
  for (std::size_t p = 0; p < sensor.pixels(); ++p) {
    const double error = darks.current_dn_per_s[p] - 0.39 * sensor.dark_e_per_s(p);
    current_error += error * error / pixels;
    explained += std::pow(darks.noise_dn[p], 2.0) * darks.covariance_per_noise2(1, 1) / pixels;
    noise_error += std::pow(darks.noise_dn[p] / 0.97949, 2.0) / pixels;
  }
  // What the map says of itself; shot noise of 10 electrons at 2 s, which noise_dn at the shortest
  // exposure leaves out, makes it a half more.
  EXPECT_GT(current_error, explained);
  EXPECT_LT(current_error, 2.5 * explained);
  EXPECT_NEAR(noise_error, 1.0, 0.02);
}

TEST(Darks, SigmasCoverTheTruth) {
  constexpr int kDraws = 200;
  SensorTruth truth;
  truth.width_px = truth.height_px = 24;
  int current_inside = 0;
  int noise_inside = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    SimpleSensor sensor(truth, 5000 + static_cast<std::uint64_t>(draw));
    const Darks darks = fit_darks(dark_stacks(sensor, 8), {});
    const auto within = [](const Estimate& found, double expected) {
      return std::abs(found.value - expected) <= 2.0 * found.sigma;
    };
    if (within(darks.mean_rate_dn_per_s, 5.0 * 0.39)) ++current_inside;
    if (within(darks.temporal_noise_dn, 0.97949)) ++noise_inside;
  }
  expect_coverage(current_inside, kDraws);
  expect_coverage(noise_inside, kDraws);
}

TEST(Darks, MarkHotAndBlinkingPixels) {
  SimpleSensor sensor(spread_truth(), 43);
  sensor.dark_e_per_s(100) = 500.0;
  sensor.dark_e_per_s(5000) = 80.0;
  sensor.blink(9000, 30.0);
  const auto stacks = dark_stacks(sensor);
  const Darks darks = fit_darks(stacks, {.gain_dn_per_e = 0.39});
  EXPECT_EQ(darks.defects[100], defect::kHot);
  EXPECT_EQ(darks.defects[5000], defect::kHot);
  EXPECT_NE(darks.defects[9000] & defect::kBlinking, 0);
  // 16384 pixels; the tail of the dark current, lognormal, holds a few beyond 6 sigma.
  EXPECT_LT(darks.bad_fraction, 10.0 / 16384.0);
  const Darks limited = fit_darks(stacks, {.hot_dn_per_s = 1.2 * 0.39 * 5.0});
  EXPECT_GT(limited.bad_fraction, 0.1);
  EXPECT_FALSE(limited.acceptance[1].passed());
}

TEST(Darks, FailABlackLevelThatMoves) {
  SimpleSensor sensor({}, 44);
  auto stacks = dark_stacks(sensor, 8);
  OwnedFrame shifted = sensor.expose(2.0, 0.0);
  for (std::uint16_t& value : shifted.pixels_dn) ++value;
  stacks.back().add(shifted.view());
  const Darks darks = fit_darks(stacks, {});
  EXPECT_FALSE(darks.acceptance[0].passed());
  EXPECT_NEAR(darks.acceptance[0].found, 1.0, 0.2);
}

TEST(Darks, RefuseWhatIsNoDark) {
  SimpleSensor sensor({}, 45);
  const auto good = dark_stacks(sensor, 8);
  const auto refused = [](std::span<const PixelStack> stacks) {
    return refusal([&] { fit_darks(stacks, {}); });
  };
  EXPECT_EQ(refused(good), "");
  EXPECT_THAT(refused({}), HasSubstr("0 exposures"));
  EXPECT_THAT(refused(std::span(good).first(1)), HasSubstr("1 exposures"));
  EXPECT_THAT(refused(std::vector<PixelStack>{good[1], good[0]}), HasSubstr("rising exposures"));
  EXPECT_THAT(refused(std::vector<PixelStack>{good[0], sensor.stack(3, 1.0, 0.0)}),
              HasSubstr("3 frames of 1 s"));
  auto lit = good;
  lit[1].add(sensor.expose(1.0, 100.0).view());
  EXPECT_THAT(refused(lit), HasSubstr("keep light out"));
  SensorTruth small;
  small.width_px = 64;
  SimpleSensor other(small, 46);
  EXPECT_THAT(refused(std::vector<PixelStack>{good[0], other.stack(8, 1.0, 0.0)}),
              HasSubstr("one size"));
  SensorTruth low;
  low.black_level_dn = 3.0;
  SimpleSensor clipped(low, 47);
  EXPECT_THAT(refused(dark_stacks(clipped, 8)), HasSubstr("raise the camera's black level"));
}

TEST(FlatDefects, MarksPixelsUnlikeTheirNeighbours) {
  constexpr int kSide = 16;
  std::vector<double> signal(kSide * kSide, 1000.0);
  for (int p = 0; p < kSide * kSide; ++p) {
    if ((p / kSide) % 2 == 0 && p % 2 == 0)
      signal[static_cast<std::size_t>(p)] = 300.0;  // a colour
  }
  signal[5 * kSide + 5] = 400.0;
  signal[0] = 500.0;  // of the weak colour, in a corner
  signal[15 * kSide + 15] = std::nan("");
  const auto defects = flat_defects(signal, kSide, kSide, 2);
  EXPECT_EQ(std::count(defects.begin(), defects.end(), defect::kCold), 3);
  EXPECT_EQ(defects[5 * kSide + 5], defect::kCold);
  EXPECT_EQ(defects[0], defect::kCold);
  EXPECT_EQ(defects[15 * kSide + 15], defect::kCold);
  EXPECT_THAT(refusal([&] { flat_defects(std::vector<double>(256, 1.0), kSide, kSide); }),
              HasSubstr("lamp is off"));
  EXPECT_THROW(flat_defects(signal, kSide, 15), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::calibration::sensor
