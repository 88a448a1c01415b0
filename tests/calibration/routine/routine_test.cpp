#include "gonio/calibration/routine/routine.h"

#include <gmock/gmock.h>

#include <chrono>

#include "hidden_bench.h"
#include "temporary_folder.h"

namespace gonio::calibration::routine {
namespace {

constexpr instrument::UtcSeconds kNoon{std::chrono::seconds(1'700'000'000)};

Routine routine_in(const std::filesystem::path& folder) {
  return Routine(test::HiddenBench::nominal(sim::HiddenImage::small), test::HiddenBench::settings(),
                 {folder}, {{"camera", "sim"}}, [] { return kNoon; });
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
  }
  Routine again = routine_in(folder.path() / "cal");
  EXPECT_EQ(again.state_of("photon_transfer"), instrument::StepState::valid);
  EXPECT_EQ(again.state_of("intrinsics"), instrument::StepState::missing);
  EXPECT_NEAR(again.instrument().sensor.gain_dn_per_e / truth.dn_per_electron, 1.0, 0.01);
}

}  // namespace
}  // namespace gonio::calibration::routine
