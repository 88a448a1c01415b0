#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>

#include "gonio/acquisition/reduction.h"
#include "hidden_bench.h"
#include "simulated_session.h"
#include "temporary_folder.h"

namespace gonio::calibration::routine {
namespace {

using namespace std::chrono_literals;

constexpr double kAlbedo = 0.05;

/// A plain rig, but a sensor with what the hidden world's has, and so much light that the white
/// takes 0.3 ms.
sim::SimOptions bright_world() {
  sim::SimOptions world =
      sim::nominal_options(std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(kAlbedo)), 7);
  world.sample_mount = {};
  world.camera.responsivity_e_per_s *= 100.0;
  world.camera.min_exposure = 10us;
  world.camera.nonlinearity = 0.003;
  world.camera.shutter_offset = 3us;
  world.camera.hot_pixel_fraction = 0.001;
  return world;
}

/// Mean of value over truth, minus 1.
double bias(const acquisition::Reduction& reduction) {
  double sum = 0.0;
  for (const samples::Sample& sample : reduction.samples.samples) {
    sum += sample.value_per_sr.mean() * std::numbers::pi / kAlbedo - 1.0;
  }
  return sum / static_cast<double>(reduction.samples.samples.size());
}

TEST(SessionSensor, BringsTheRatioToTheWhiteNearerTheTruth) {
  const TemporaryFolder folder;
  const sim::SimOptions world = bright_world();
  const instrument::Instrument nominal = nominal_instrument(world);
  test::HiddenBench bench(world);
  Routine routine(nominal, test::HiddenBench::settings(), {folder.path() / "cal"},
                  {{"camera", "sim"}},
                  [] { return instrument::UtcSeconds(std::chrono::seconds(1'700'000'000)); });
  for (const char* step : {"darks", "linearity", "bad_pixels"}) {
    routine.take(step, bench.devices, {}, {});
  }
  const instrument::Instrument found = routine.instrument();

  const std::filesystem::path session = folder.path() / "session";
  acquisition::SessionOptions options;
  options.relative_sigma = 0.001;
  {
    acquisition::SessionWriter archive(session, {}, {});
    const auto plan = plan_of(found, {{3.0, 12.0, 28.0}});
    EXPECT_EQ(run_session(bench.devices, found, plan, options, archive).measured, 1);
  }
  const acquisition::SessionReader archive(session);
  const double without = bias(acquisition::reduce(archive, nominal));
  const double with = bias(acquisition::reduce(archive, found));
  // 3 us count for 1 % of the white's exposure, hardly of the sample's, twenty times as long.
  EXPECT_LT(without, -0.005);
  EXPECT_NEAR(with, 0.0, 0.002);
}

}  // namespace
}  // namespace gonio::calibration::routine
