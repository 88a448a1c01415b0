#include <gtest/gtest.h>

#include <chrono>
#include <cmath>

#include "hidden_bench.h"
#include "temporary_folder.h"

namespace gonio::calibration::routine {
namespace {

using namespace std::chrono_literals;

// A camera slow enough that the lamp, just switched on, brightens by a third of a percent during
// the sweep: exposures taken from faint to bright would show that as a bend of their own.
TEST(DriftingLamp, DoesNotPassForABendOfTheSensor) {
  const TemporaryFolder folder;
  sim::SimOptions world = test::HiddenBench::options_with_board(1, sim::HiddenImage::small);
  world.camera.readout = 4s;
  world.lamp.drift_sigma = 0.0;
  test::HiddenBench bench(world);
  Routine routine(test::HiddenBench::nominal(sim::HiddenImage::small),
                  test::HiddenBench::settings(), {folder.path() / "cal"}, {{"camera", "sim"}},
                  [] { return test::kNoon; });
  routine.take("darks", bench.devices, {}, {});
  routine.take("linearity", bench.devices, {}, {});
  const sim::CameraOptions& camera = bench.world.truth().camera;
  // Written down is y = x (1 - nonlinearity (x / top)^2), black level and all.
  const double top_dn = 4095.0;
  const double bright_dn = 0.75 * top_dn;
  const double written = bright_dn + camera.black_level_dn;
  const double truth =
      1.0 + camera.nonlinearity * std::pow(written / top_dn, 2.0) * written / bright_dn;
  const double found = routine.findings().linearity->curve.linear_dn(bright_dn) / bright_dn;
  RecordProperty("error", std::to_string(found - truth));
  EXPECT_NEAR(found, truth, 0.0008);
}

}  // namespace
}  // namespace gonio::calibration::routine
