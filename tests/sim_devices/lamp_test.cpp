#include <gtest/gtest.h>

#include <cmath>

#include "worlds.h"

namespace gonio::sim {
namespace {

TEST(SimLamp, WarmsUpExponentially) {
  SimOptions options = ideal_options(0.5);
  options.lamp.warm_up_amplitude = 0.2;
  options.lamp.warm_up_tau = 600s;
  options.lamp.on_before = 0s;
  SimGoniometer world(options);
  world.light_source().light("G");
  EXPECT_NEAR(world.lamp_monitor().read(), 0.8, 1e-12);
  world.clock().wait_until(600s);
  EXPECT_NEAR(world.lamp_monitor().read(), 1.0 - 0.2 * 0.36787944117, 1e-9);
}

TEST(SimLamp, DriftHasItsSizeAndItsMemory) {
  SimOptions options = ideal_options(0.5);
  options.lamp.drift_sigma = 0.01;
  options.lamp.drift_tau = 100s;
  SimGoniometer world(options);
  world.light_source().light("G");
  constexpr int kReadings = 4000;
  double squares = 0.0;
  double products = 0.0;
  double before = 0.0;
  for (int reading = 0; reading < kReadings; ++reading) {
    world.clock().wait_until(reading * 50s);  // half the memory apart
    const double drift = world.lamp_monitor().read() - 1.0;
    squares += drift * drift;
    if (reading > 0) products += drift * before;
    before = drift;
  }
  const double variance = squares / kReadings;
  // 4000 readings correlated over two steps are worth about 1800: 1.7 % of sigma, four of these.
  EXPECT_NEAR(std::sqrt(variance), 0.01, 0.0007);
  EXPECT_NEAR(products / (kReadings - 1) / variance, 0.60653, 0.06);  // e^-0.5
}

TEST(SimLamp, DriftDoesNotDependOnWhoAskedBefore) {
  SimOptions options = ideal_options(0.5);
  options.lamp.drift_sigma = 0.01;
  SimGoniometer often(options);
  SimGoniometer once(options);
  often.light_source().light("G");
  once.light_source().light("G");
  for (int second = 0; second <= 1000; second += 7) {
    often.clock().wait_until(std::chrono::seconds(second));
    often.lamp_monitor().read();
  }
  often.clock().wait_until(1000500ms);
  once.clock().wait_until(1000500ms);
  EXPECT_EQ(often.lamp_monitor().read(), once.lamp_monitor().read());
}

TEST(SimLamp, DriftsChangeThePictureAndTheMonitorAlike) {
  SimOptions options = ideal_options(0.5);
  options.lamp.drift_sigma = 0.1;
  options.lamp.drift_tau = 1s;
  SimGoniometer world(options);
  home(world);
  move_to(world, {60.0_deg, 60.0_deg, 0.0_deg});
  world.light_source().light("G");
  for (int index = 0; index < 5; ++index) {
    world.clock().wait_until(world.clock().now() + 10s);
    const double monitor = world.lamp_monitor().read();
    const double dn = centre_dn(world.camera().capture(1ms));
    EXPECT_NEAR(dn, monitor * 50.89884, 0.6);  // rounding; the drift of half a millisecond is less
  }
}

TEST(SimLamp, MonitorReadsZeroInTheDarkAndScattersAsAsked) {
  SimOptions options = ideal_options(0.5);
  options.lamp.monitor_sigma = 0.001;
  SimGoniometer world(options);
  double squares = 0.0;
  constexpr int kReadings = 400;
  for (int reading = 0; reading < kReadings; ++reading) {
    squares += std::pow(world.lamp_monitor().read(), 2.0);
  }
  EXPECT_NEAR(std::sqrt(squares / kReadings), 0.001, 0.00015);  // four standard errors
}

TEST(SimLamp, AmbientLightStaysWhenTheShutterCloses) {
  SimOptions options = ideal_options(0.5);
  options.scene.ambient_radiance = 0.5;
  SimGoniometer world(options);
  // 0.39 * 205000 * 0.01 * 0.5 = 399.75 on every pixel
  const auto frame = world.camera().capture(10ms);
  EXPECT_NEAR(frame.at(3, 7) - frame.black_level_dn, 399.75, 1.2);
  EXPECT_NEAR(centre_dn(frame), 399.75, 1.2);
}

TEST(SimLamp, AmbientLightIsWhatTheStepsSayFromTheirTimesOn) {
  SimOptions options = ideal_options(0.5);
  options.scene.ambient_steps = {{5ms, 0.5}, {40ms, 0.0}};
  SimGoniometer world(options);
  // 10 ms each and as much for the readout: their middles lie at 5, 25 and 45 ms.
  for (const double wanted : {399.75, 399.75, 0.0}) {
    const auto frame = world.camera().capture(10ms);
    EXPECT_NEAR(centre_dn(frame), wanted, 1.2);
  }
}

TEST(SimLamp, StrayLightIsAFractionOfWhiteAndGoesWithTheLamp) {
  SimOptions options = ideal_options(0.0);
  options.lamp.stray_fraction = 0.5;
  SimGoniometer world(options);
  const auto lit = picture(world, {60.0_deg, 60.0_deg, 0.0_deg});
  EXPECT_NEAR(centre_dn(lit), 508.9884, 0.7);  // half of a white is a plate of albedo 0.5
  world.light_source().close_shutter();
  EXPECT_NEAR(centre_dn(world.camera().capture(10ms)), 0.0, 0.7);
}

TEST(SimLamp, ChannelsAreTheOnesConfigured) {
  SimGoniometer world(ideal_options(0.5));
  const auto channels = world.light_source().channels();
  ASSERT_EQ(channels.size(), 3U);
  EXPECT_EQ(channels[0].name, "R");
  EXPECT_EQ(channels[0].wavelength_nm, 630.0);
  EXPECT_EQ(channels[1].name, "G");
  EXPECT_EQ(channels[2].name, "B");
}

}  // namespace
}  // namespace gonio::sim
