#include "gonio/calibration/sensor/photon_transfer.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <array>

#include "gonio/calibration/sensor/linearity.h"
#include "refused.h"
#include "simple_sensor.h"

namespace gonio::calibration::sensor {
namespace {

using testing::HasSubstr;

constexpr std::array<double, 4> kDarkTimes_s{50e-6, 50e-6, 0.01, 0.02};

double relative(double found, double truth) { return found / truth - 1.0; }

TEST(PhotonTransfer, FindsTheHiddenSensor) {
  SensorTruth truth;
  truth.width_px = truth.height_px = 256;
  SimpleSensor sensor(truth, 11);
  const auto dark = sensor.dark_levels(kDarkTimes_s);
  const auto result = fit_photon_transfer(dark, sensor.sweep(20, 10500.0), {});

  constexpr double kGain = 0.01;  // tolerances of the specification, 3.8
  constexpr double kReadNoise = 0.03;
  constexpr double kFullWell = 0.03;
  EXPECT_NEAR(relative(result.gain_dn_per_e.value, truth.gain_dn_per_e), 0.0, kGain);
  EXPECT_NEAR(relative(result.read_noise_e.value, truth.read_noise_e), 0.0, kReadNoise);
  ASSERT_TRUE(result.full_well_e.has_value());
  EXPECT_NEAR(relative(result.full_well_e->value, truth.full_well_e), 0.0, kFullWell);
  EXPECT_TRUE(result.saturation_reached);
  EXPECT_FALSE(result.read_noise_is_bound);
  // The levels are 525 electrons apart, and the variance falls from 2 sigma of shot noise and PRNU
  // below the full well on.
  EXPECT_LT(result.saturation_e.value, truth.full_well_e);
  EXPECT_NEAR(result.saturation_e.value, truth.full_well_e - 2.0 * 110.0, 525.0);
  EXPECT_NEAR(result.black_level_dn.value, truth.black_level_dn, 0.02);  // DSNU of the mean 0.002
  EXPECT_NEAR(result.snr_max.value, std::sqrt(8780.0), 3.0);
  // SNR 1: 0.5 e above the noise of 2.4 e and of rounding, 0.74 e.
  EXPECT_NEAR(result.threshold_e.value, 3.01, 0.05);
  EXPECT_NEAR(result.dynamic_range.value, 8780.0 / 3.01, 0.07 * 8780.0 / 3.01);
  EXPECT_LT(result.light_noise, 1e-4);
  EXPECT_LT(result.chi2_per_dof, 2.5);
  // What the specification's prototype reached, doubled by the curvature.
  EXPECT_LT(result.gain_dn_per_e.sigma, 0.005 * truth.gain_dn_per_e);
}

TEST(PhotonTransfer, SigmasCoverTheTruth) {
  constexpr int kDraws = 200;
  SensorTruth truth;
  truth.width_px = truth.height_px = 40;
  int gain_inside = 0;
  int noise_inside = 0;
  int joint_inside = 0;
  double gain_sum = 0.0;
  double noise_sum = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    SimpleSensor sensor(truth, 1000 + static_cast<std::uint64_t>(draw));
    const auto dark = sensor.dark_levels(kDarkTimes_s);
    const auto result = fit_photon_transfer(dark, sensor.sweep(12, 6000.0), {});
    const double gain_error = result.gain_dn_per_e.value - truth.gain_dn_per_e;
    const double noise_error = result.read_noise_e.value - truth.read_noise_e;
    if (std::abs(gain_error) <= 2.0 * result.gain_dn_per_e.sigma) ++gain_inside;
    if (std::abs(noise_error) <= 2.0 * result.read_noise_e.sigma) ++noise_inside;
    const Eigen::Vector2d error(gain_error, noise_error);
    constexpr double kChi2Of954 = 6.18;  // two degrees of freedom, 95.45 %
    if (error.dot(result.covariance.inverse() * error) <= kChi2Of954) ++joint_inside;
    gain_sum += relative(result.gain_dn_per_e.value, truth.gain_dn_per_e);
    noise_sum += relative(result.read_noise_e.value, truth.read_noise_e);
  }
  expect_coverage(gain_inside, kDraws);
  expect_coverage(noise_inside, kDraws);
  expect_coverage(joint_inside, kDraws);
  // One draw has sigmas of 2 and 2.5 %: 3 sigma of the mean of 200.
  EXPECT_NEAR(gain_sum / kDraws, 0.0, 0.0045);
  EXPECT_NEAR(noise_sum / kDraws, 0.0, 0.0055);
  RecordProperty("gain_bias_percent", std::to_string(100.0 * gain_sum / kDraws));
  RecordProperty("noise_bias_percent", std::to_string(100.0 * noise_sum / kDraws));
}

TEST(PhotonTransfer, DarkCurrentLeavesTheReadNoiseAlone) {
  SensorTruth truth;
  truth.width_px = truth.height_px = 256;
  truth.dark_current_e_per_s = 400.0;  // 8 e at 20 ms: more variance than the read noise's 5.8
  SimpleSensor sensor(truth, 12);
  constexpr std::array<double, 3> kLongDarks{0.01, 0.015, 0.02};
  const auto result =
      fit_photon_transfer(sensor.dark_levels(kLongDarks), sensor.sweep(20, 8000.0), {});
  EXPECT_NEAR(relative(result.read_noise_e.value, truth.read_noise_e), 0.0, 0.03);
  EXPECT_NEAR(relative(result.gain_dn_per_e.value, truth.gain_dn_per_e), 0.0, 0.01);
  EXPECT_NEAR(relative(result.dark_rate_dn_per_s.value, 400.0 * 0.39), 0.0, 0.02);
}

TEST(PhotonTransfer, HoldsTheGainOnABentSensor) {
  SensorTruth truth;
  truth.width_px = truth.height_px = 256;
  truth.nonlinearity = 0.01;  // three times the simulated rig's
  SimpleSensor sensor(truth, 13);
  const auto dark = sensor.dark_levels(kDarkTimes_s);
  const auto levels = sensor.sweep(30, 8800.0);
  const auto gain_error = [&](const PhotonTransferOptions& options) {
    return relative(fit_photon_transfer(dark, levels, options).gain_dn_per_e.value,
                    truth.gain_dn_per_e);
  };
  EXPECT_GT(std::abs(gain_error({.curved = false})), 0.005);  // the bend matters here
  EXPECT_NEAR(gain_error({}), 0.0, 0.01);
  const Linearity linearity = fit_linearity(dark, levels, {});
  EXPECT_NEAR(gain_error({.response = linearity.curve, .curved = false}), 0.0, 0.004);
}

TEST(PhotonTransfer, SaysWhenQuantisationHidesTheReadNoise) {
  SensorTruth truth;
  truth.gain_dn_per_e = 0.1;
  truth.read_noise_e = 2.0;  // 0.2 DN
  truth.full_well_e = 36000.0;
  SimpleSensor sensor(truth, 14);
  const auto result =
      fit_photon_transfer(sensor.dark_levels(kDarkTimes_s), sensor.sweep(20, 38000.0), {});
  EXPECT_TRUE(result.read_noise_is_bound);
  EXPECT_GT(result.read_noise_e.value, truth.read_noise_e);
  EXPECT_NEAR(relative(result.gain_dn_per_e.value, truth.gain_dn_per_e), 0.0, 0.02);
}

TEST(PhotonTransfer, SaysWhenSaturationWasNotReached) {
  SimpleSensor sensor({}, 15);
  const auto result =
      fit_photon_transfer(sensor.dark_levels(kDarkTimes_s), sensor.sweep(14, 7000.0), {});
  EXPECT_FALSE(result.saturation_reached);
  EXPECT_FALSE(result.full_well_e.has_value());
}

TEST(PhotonTransfer, MeasuresLightThatFlickers) {
  SimpleSensor sensor({}, 16);
  const auto dark = sensor.dark_levels(kDarkTimes_s);
  std::vector<LevelStatistics> levels;
  for (int k = 1; k <= 16; ++k) {
    const double light = 2.0e4 * k;
    const double sign = k % 2 == 0 ? 1.0 : -1.0;
    const OwnedFrame a = sensor.expose(0.02, light);
    const OwnedFrame b = sensor.expose(0.02, light * (1.0 + sign * 0.008));
    levels.push_back(level_statistics(a.view(), b.view(), {}));
  }
  const auto result = fit_photon_transfer(dark, levels, {});
  EXPECT_NEAR(result.light_noise, 0.008, 0.0008);
  EXPECT_NEAR(relative(result.gain_dn_per_e.value, 0.39), 0.0, 0.02);
}

TEST(PhotonTransfer, RefusesWhatIsNoSweep) {
  SimpleSensor sensor({}, 17);
  const auto dark = sensor.dark_levels(kDarkTimes_s);
  const auto levels = sensor.sweep(12, 8000.0);
  const auto refused = [](std::span<const LevelStatistics> darks,
                          std::span<const LevelStatistics> bright) {
    return refusal([&] { fit_photon_transfer(darks, bright, {}); });
  };
  EXPECT_EQ(refused(dark, levels), "");
  EXPECT_THAT(refused({}, levels), HasSubstr("no dark level"));
  EXPECT_THAT(refused(dark, {}), HasSubstr("0 levels"));
  EXPECT_THAT(refused(dark, dark), HasSubstr("lamp is off"));
  EXPECT_THAT(refused(std::span(levels).last(1), levels), HasSubstr("light came in"));
  EXPECT_THAT(refused(dark, std::span(levels).first(4)), HasSubstr("expose longer"));
  EXPECT_THAT(refused(dark, std::span(levels).last(6)), HasSubstr("take more levels there"));

  std::vector<LevelStatistics> full;
  for (int k = 0; k < 10; ++k) full.push_back(sensor.level(0.02 + 0.001 * k, 1e7));
  EXPECT_THAT(refused(dark, full), HasSubstr("0 of 10 levels"));

  std::vector<LevelStatistics> denoised = levels;
  for (LevelStatistics& level : denoised) level.variance_dn2 = {1.0, 0.01};
  EXPECT_THAT(refused(dark, denoised), HasSubstr("not raw frames"));

  SensorTruth low;
  low.black_level_dn = 1.0;
  SimpleSensor clipped(low, 18);
  EXPECT_THAT(refused(clipped.dark_levels(kDarkTimes_s), levels), HasSubstr("black level"));
}

}  // namespace
}  // namespace gonio::calibration::sensor
