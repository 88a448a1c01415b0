#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "worlds.h"

namespace gonio::sim {
namespace {

/// A plate of albedo 0.5 facing a collimated lamp, of which every pixel sees the same; the sensor
/// counts single electrons and has no other peculiarity.
/// Electrons per second: 205000 * 4 W/m^2 * 0.5 / pi = 130507.05.
SimOptions even_plate() {
  SimOptions options = ideal_options(0.5);
  const SimOptions nominal = nominal_options(options.scene.sample, 1);
  options.rig.collimated_lamp = true;
  options.scene.sample_half_width_mm = 1000.0;
  options.camera.responsivity_e_per_s = nominal.camera.responsivity_e_per_s;
  options.camera.dn_per_electron = nominal.camera.dn_per_electron;
  options.camera.full_well_e = nominal.camera.full_well_e;
  options.camera.bits = 12;
  return options;
}

constexpr double kElectronsPerSecond = 130507.05;
constexpr double kGain = 0.39;

struct Level {
  double mean_dn;       ///< above black
  double variance_dn2;  ///< in time, by the difference of two frames
};

Level level(SimGoniometer& world, std::chrono::nanoseconds exposure) {
  const auto a = world.camera().capture(exposure);
  const auto b = world.camera().capture(exposure);
  double sum = 0.0;
  double difference = 0.0;
  double squares = 0.0;
  const auto count = static_cast<double>(a.pixels_dn.size());
  for (std::size_t pixel = 0; pixel < a.pixels_dn.size(); ++pixel) {
    sum += a.pixels_dn[pixel] + b.pixels_dn[pixel];
    const double d = static_cast<double>(a.pixels_dn[pixel]) - b.pixels_dn[pixel];
    difference += d;
    squares += d * d;
  }
  return {sum / (2.0 * count) - a.black_level_dn,
          0.5 * (squares / count - std::pow(difference / count, 2.0))};
}

void face_the_lamp(SimGoniometer& world) {
  home(world);
  move_to(world, {60.0_deg, 60.0_deg, 0.0_deg});
  world.light_source().light("G");
}

// Over 81,920 pixels a mean is known to sigma/286 and a variance of two frames to 0.5 %.
constexpr double kFourSigmasOfVariance = 0.02;

TEST(SimSensor, MeanIsGainTimesElectrons) {
  SimGoniometer world(even_plate());
  face_the_lamp(world);
  for (const auto exposure : {1ms, 10ms, 50ms}) {
    const double electrons = kElectronsPerSecond * std::chrono::duration<double>(exposure).count();
    EXPECT_NEAR(level(world, exposure).mean_dn, kGain * electrons,
                4.0 * kGain * std::sqrt(electrons) / 404.0);
  }
}

TEST(SimSensor, PhotonTransferSlopeIsTheGain) {
  SimGoniometer world(even_plate());
  face_the_lamp(world);
  for (const auto exposure : {3ms, 10ms, 50ms}) {
    const Level seen = level(world, exposure);
    // Quantisation adds 1/12 DN^2.
    EXPECT_NEAR((seen.variance_dn2 - 1.0 / 12.0) / seen.mean_dn, kGain,
                kFourSigmasOfVariance * kGain);
  }
}

TEST(SimSensor, ReadNoiseIsTheVarianceOfTheDark) {
  SimOptions options = even_plate();
  options.camera.read_noise_e = 2.4;
  SimGoniometer world(options);
  const Level dark = level(world, 50us);
  EXPECT_NEAR(dark.mean_dn, 0.0, 4.0 * kGain * 2.4 / 404.0);
  // (0.39 * 2.4)^2 + 1/12
  EXPECT_NEAR(dark.variance_dn2, 0.959429, kFourSigmasOfVariance * 0.959429);
}

TEST(SimSensor, DarkStandsAtTheBlackLevel) {
  SimOptions options = even_plate();
  options.camera.black_level_dn = 100.0;
  SimGoniometer world(options);
  const auto frame = world.camera().capture(1ms);
  EXPECT_EQ(frame.black_level_dn, 100.0);
  EXPECT_TRUE(std::all_of(frame.pixels_dn.begin(), frame.pixels_dn.end(),
                          [](std::uint16_t dn) { return dn == 100; }));
}

TEST(SimSensor, DarkCurrentGrowsWithTimeAndHasItsShotNoise) {
  SimOptions options = even_plate();
  options.camera.dark_current_e_per_s = 100.0;
  options.camera.dark_current_spread = 0.0;
  SimGoniometer world(options);
  const Level dark = level(world, 5s);
  EXPECT_NEAR(dark.mean_dn, kGain * 500.0, 0.1);
  EXPECT_NEAR(dark.variance_dn2, kGain * kGain * 500.0 + 1.0 / 12.0,
              kFourSigmasOfVariance * kGain * kGain * 500.0);
}

TEST(SimSensor, HotPixelsAreAsManyAndAsHotAsAsked) {
  SimOptions options = even_plate();
  options.camera.dark_current_e_per_s = 5.0;
  options.camera.dark_current_spread = 0.0;
  options.camera.hot_pixel_fraction = 0.001;
  options.camera.hot_pixel_factor = 100.0;
  SimGoniometer world(options);
  const auto frame = world.camera().capture(10s);
  // Cold: 50 electrons, hot: 5000.
  const auto hot = std::count_if(frame.pixels_dn.begin(), frame.pixels_dn.end(),
                                 [](std::uint16_t dn) { return dn > 500; });
  EXPECT_NEAR(static_cast<double>(hot), 81.92, 4.0 * 9.05);
  const auto brightest = *std::max_element(frame.pixels_dn.begin(), frame.pixels_dn.end());
  EXPECT_NEAR(brightest - 64.0, kGain * 5000.0, kGain * 5.0 * 71.0);
}

TEST(SimSensor, SaturatesAtTheLargestNumber) {
  SimGoniometer world(even_plate());
  face_the_lamp(world);
  const auto frame = world.camera().capture(1s);
  EXPECT_EQ(frame.saturation_level_dn, 4095);
  EXPECT_TRUE(std::all_of(frame.pixels_dn.begin(), frame.pixels_dn.end(),
                          [](std::uint16_t dn) { return dn == 4095; }));
}

TEST(SimSensor, SaturatesAtTheFullWellWhenThatComesFirst) {
  SimOptions options = even_plate();
  options.camera.full_well_e = 5000.0;
  options.camera.read_noise_e = 2.4;
  SimGoniometer world(options);
  face_the_lamp(world);
  const auto frame = world.camera().capture(1s);
  // 64 + 0.39 * 5000 = 2014; the camera calls saturated what is within four sigmas of it.
  EXPECT_LT(frame.saturation_level_dn, 2014);
  EXPECT_GT(frame.saturation_level_dn, 2005);
  const auto below =
      std::count_if(frame.pixels_dn.begin(), frame.pixels_dn.end(),
                    [&](std::uint16_t dn) { return dn < frame.saturation_level_dn; });
  EXPECT_LT(below, 30);  // 3e-5 of the pixels lie beyond four sigmas
}

double spatial_sigma(const std::vector<double>& values) {
  double sum = 0.0;
  double squares = 0.0;
  for (const double value : values) {
    sum += value;
    squares += value * value;
  }
  const auto count = static_cast<double>(values.size());
  return std::sqrt(squares / count - std::pow(sum / count, 2.0));
}

std::vector<double> mean_of_frames(SimGoniometer& world, std::chrono::nanoseconds exposure,
                                   int frames) {
  std::vector<double> mean;
  for (int index = 0; index < frames; ++index) {
    const auto frame = world.camera().capture(exposure);
    mean.resize(frame.pixels_dn.size(), 0.0);
    for (std::size_t pixel = 0; pixel < mean.size(); ++pixel) {
      mean[pixel] += (frame.pixels_dn[pixel] - frame.black_level_dn) / frames;
    }
  }
  return mean;
}

TEST(SimSensor, FixedPatternOfTheResponseIsTheSameInEveryFrame) {
  SimOptions options = even_plate();
  options.camera.prnu = 0.02;
  SimGoniometer world(options);
  face_the_lamp(world);
  // 6525 electrons, 2545 DN: PRNU 50.9 DN; shot noise of 8 frames 31.5 / sqrt(8) = 11.1 DN.
  const auto mean = mean_of_frames(world, 50ms, 8);
  EXPECT_NEAR(std::sqrt(std::pow(spatial_sigma(mean), 2.0) - 11.14 * 11.14), 50.9, 0.6);
}

TEST(SimSensor, FixedPatternOfTheOffsetIsTheSameInEveryFrame) {
  SimOptions options = even_plate();
  options.camera.dsnu_e = 12.0;
  SimGoniometer world(options);
  // 4.68 DN, and a twelfth of a DN^2 of rounding
  EXPECT_NEAR(spatial_sigma(mean_of_frames(world, 1ms, 1)), std::sqrt(4.68 * 4.68 + 1.0 / 12.0),
              0.05);
}

TEST(SimSensor, AnotherNoiseSeedIsAnotherSessionWithTheSameSensor) {
  SimOptions options = even_plate();
  options.camera.dsnu_e = 20.0;
  options.camera.read_noise_e = 2.0;
  const auto dark = [&](std::optional<std::uint64_t> noise_seed) {
    options.noise_seed = noise_seed;
    return SimGoniometer(options).camera().capture(1ms).pixels_dn;
  };
  const auto day = dark(std::nullopt);
  EXPECT_EQ(day, dark(options.seed));
  const auto other_day = dark(2);
  double squares = 0.0;
  for (std::size_t pixel = 0; pixel < day.size(); ++pixel) {
    squares += std::pow(static_cast<double>(day[pixel]) - other_day[pixel], 2.0);
  }
  // Read noise and rounding of two frames are left; the pattern, ten times that, is not.
  const double noise_dn2 = 2.0 * (std::pow(2.0 * kGain, 2.0) + 1.0 / 12.0);
  EXPECT_NEAR(squares / static_cast<double>(day.size()) / noise_dn2, 1.0, kFourSigmasOfVariance);
}

TEST(SimSensor, VignettingFollowsItsPolynomialByFieldAngle) {
  SimOptions options = ideal_options(0.5);
  options.rig.collimated_lamp = true;
  options.scene.sample_half_width_mm = 1000.0;
  options.camera.vignetting = {-10.0, 100.0, -200.0};
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 60.0_deg, 0.0_deg}, 40ms);
  // Corner (0, 0): q = (160^2 + 128^2) / 1381^2 = 0.02201386;
  // 1 - 0.2201386 + 0.04846101 - 0.00213363 = 0.82618878
  const double corner = frame.at(0, 0) - frame.black_level_dn;
  EXPECT_NEAR(corner / centre_dn(frame), 0.82618878, 0.0015);
}

TEST(SimSensor, NonlinearityBendsTheTop) {
  SimOptions options = ideal_options(0.5);
  options.camera.bits = 12;
  options.camera.black_level_dn = 0.0;
  options.camera.nonlinearity = 0.1;
  SimGoniometer world(options);
  // Straight 2035.95 DN at 40 ms: half of 4095 minus 0.1 * 0.49718^2 of it.
  const auto frame = picture(world, {60.0_deg, 60.0_deg, 0.0_deg}, 40ms);
  EXPECT_NEAR(centre_dn(frame), 2035.95 * (1.0 - 0.1 * 0.247187), 1.5);
}

TEST(SimSensor, ShutterOffsetLetsInMoreLightThanReported) {
  SimOptions options = ideal_options(0.5);
  options.camera.shutter_offset = 1ms;
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 60.0_deg, 0.0_deg}, 9ms);
  EXPECT_EQ(frame.exposure, 9ms);
  EXPECT_NEAR(centre_dn(frame), 508.9884, 0.7);  // as 10 ms
}

TEST(SimSensor, ExposureIsRoundedToItsStepAndReportedSo) {
  SimOptions options = ideal_options(0.5);
  options.camera.exposure_step = 10us;
  SimGoniometer world(options);
  EXPECT_EQ(world.camera().capture(1234567ns).exposure, 1230us);
  EXPECT_EQ(world.camera().capture(1235000ns).exposure, 1240us);
}

TEST(SimSensor, BayerPixelsSeeTheirColour) {
  using devices::PixelFormat;
  struct Phase {
    PixelFormat format;
    std::array<int, 4> colours;  // in reading order, 0 R, 1 G, 2 B
  };
  const Phase phases[] = {{PixelFormat::bayer_rggb, {0, 1, 1, 2}},
                          {PixelFormat::bayer_grbg, {1, 0, 2, 1}},
                          {PixelFormat::bayer_gbrg, {1, 2, 0, 1}},
                          {PixelFormat::bayer_bggr, {2, 1, 1, 0}}};
  constexpr std::array<double, 3> kRelative{1.0, 0.5, 0.2};
  for (const Phase& phase : phases) {
    SimOptions options = ideal_options(0.5);
    options.rig.collimated_lamp = true;
    options.scene.sample = std::make_shared<brdf::Lambertian>(brdf::Rgb(0.5, 0.25, 0.1));
    options.camera.pixel_format = phase.format;
    options.lamp.channels = LampOptions::white_channel();
    SimGoniometer world(options);
    const auto frame = picture(world, {60.0_deg, 60.0_deg, 0.0_deg}, 10ms, "white");
    EXPECT_EQ(frame.pixel_format, phase.format);
    for (int place = 0; place < 4; ++place) {
      // Row 128 and column 160 are even: they have the phase of the frame's corner.
      const double dn = frame.at(kCentreRow + place / 2, kCentreColumn + place % 2) - 64.0;
      EXPECT_NEAR(
          dn,
          508.9884 *
              kRelative[static_cast<std::size_t>(phase.colours[static_cast<std::size_t>(place)])],
          0.7)
          << to_string(phase.format) << " place " << place;
    }
  }
}

TEST(SimSensor, BayerCrosstalkLeaksNeighbouringColours) {
  SimOptions options = ideal_options(0.5);
  options.rig.collimated_lamp = true;
  options.scene.sample = std::make_shared<brdf::Lambertian>(brdf::Rgb(0.5, 0.0, 0.0));
  options.camera.pixel_format = devices::PixelFormat::bayer_rggb;
  options.camera.bayer_crosstalk = {{{0.9, 0.1, 0.0}, {0.2, 0.7, 0.1}, {0.05, 0.1, 0.85}}};
  options.lamp.channels = LampOptions::white_channel();
  SimGoniometer world(options);
  const auto frame = picture(world, {60.0_deg, 60.0_deg, 0.0_deg}, 10ms, "white");
  EXPECT_NEAR(frame.at(128, 160) - 64.0, 0.9 * 508.9884, 0.7);
  EXPECT_NEAR(frame.at(128, 161) - 64.0, 0.2 * 508.9884, 0.7);
  EXPECT_NEAR(frame.at(129, 161) - 64.0, 0.05 * 508.9884, 0.7);
}

}  // namespace
}  // namespace gonio::sim
