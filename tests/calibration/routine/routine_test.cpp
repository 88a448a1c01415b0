#include "gonio/calibration/routine/routine.h"

#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <filesystem>

#include "gonio/calibration/routine/expected_time.h"
#include "hidden_bench.h"
#include "recovery.h"
#include "temporary_folder.h"

namespace gonio::calibration::routine {
namespace {

Routine routine_in(const std::filesystem::path& folder) {
  return Routine(test::HiddenBench::nominal(sim::HiddenImage::small), test::HiddenBench::settings(),
                 {folder}, {{"camera", "sim"}}, [] { return test::kNoon; });
}

TEST(Routine, FindsTheSensorOfAHiddenWorldAndGoesOnFromTheFolder) {
  const TemporaryFolder folder;
  test::HiddenBench bench(1);
  const sim::CameraOptions& truth = bench.world.truth().camera;
  {
    Routine routine = routine_in(folder.path() / "cal");
    for (const char* step : {"darks", "linearity", "photon_transfer", "bad_pixels"}) {
      routine.take(step, bench.devices, {}, {});
    }
    const auto found = routine.instrument().sensor;
    EXPECT_NEAR(found.gain_dn_per_e / truth.dn_per_electron, 1.0, 0.01);
    EXPECT_NEAR(found.read_noise_e / truth.read_noise_e, 1.0, 0.03);
    EXPECT_NEAR(found.shutter_offset_s, devices::to_seconds(truth.shutter_offset), 1.5e-6);
    // A signal of 3000 DN is bent by 0.16 %.
    const double read_dn = truth.black_level_dn + 3000.0;
    const double bent_dn = read_dn * (1.0 - truth.nonlinearity * std::pow(read_dn / 4095.0, 2));
    EXPECT_NEAR(found.response.linear_dn(bent_dn - truth.black_level_dn) / 3000.0, 1.0, 0.0008);
    // 0.02 % of the pixels are hot; some are too little so to be told from the others.
    const double pixels = 612.0 * 512.0;
    EXPECT_GT(static_cast<double>(found.bad_pixels.size()), 0.00015 * pixels);
    EXPECT_LT(static_cast<double>(found.bad_pixels.size()), 0.002 * pixels);
  }
  Routine again = routine_in(folder.path() / "cal");
  EXPECT_EQ(again.state_of("photon_transfer"), instrument::StepState::valid);
  EXPECT_EQ(again.state_of("intrinsics"), instrument::StepState::missing);
  EXPECT_NEAR(again.instrument().sensor.gain_dn_per_e / truth.dn_per_electron, 1.0, 0.01);
}

class HiddenTruth : public ::testing::TestWithParam<std::uint64_t> {};

// The whole routine at a quarter of the pixels; another seed is looked at by calibrated_world, and
// the full size in the benchmark.
TEST_P(HiddenTruth, IsFoundWithinTheLimits) {
  const TemporaryFolder folder;
  test::HiddenBench bench(GetParam());
  Routine routine = routine_in(folder.path() / "cal");
  for (const instrument::CalibrationStep& step : instrument::calibration_steps()) {
    const auto begun = bench.world.clock().now();
    routine.take(std::string(step.name), bench.devices, {}, {});
    // What tells an operator how long it will take need not be better than that.
    const double took_s = devices::to_seconds(bench.world.clock().now() - begun);
    const double expected_s = expected_time(step.name, routine.settings()).on_rig_s;
    EXPECT_LE(took_s, 2.0 * expected_s) << step.name;
    EXPECT_GE(took_s + 1.0, 0.5 * expected_s) << step.name;
  }
  constexpr double kAnglesAtAQuarter = 3.0;
  for (const test::Recovered& each :
       test::recovered(routine, bench.world.truth(), kAnglesAtAQuarter)) {
    EXPECT_LT(std::abs(each.error), each.limit) << each.name << " " << each.unit;
  }
  EXPECT_TRUE(std::filesystem::exists(folder.path() / "cal" / "instrument.json"));
}
INSTANTIATE_TEST_SUITE_P(Seeds, HiddenTruth, ::testing::Values(2U));

}  // namespace
}  // namespace gonio::calibration::routine
