#include "time_account.h"

#include <gtest/gtest.h>

#include <thread>

#include "gonio/brdf/diffuse_models.h"

namespace gonio::emulate {
namespace {

using namespace std::chrono_literals;

constexpr double kRounding = 1e-9;

HostTime at(std::chrono::milliseconds time) { return HostTime(1h + time); }

TEST(TimeAccount, UnionCountsWhatOverlapsOnce) {
  EXPECT_EQ(union_seconds({}), 0.0);
  EXPECT_NEAR(union_seconds({{at(0ms), at(10ms)}, {at(5ms), at(20ms)}}), 0.020, kRounding);
  EXPECT_NEAR(union_seconds({{at(30ms), at(40ms)}, {at(0ms), at(10ms)}}), 0.020, kRounding);
  EXPECT_NEAR(union_seconds({{at(0ms), at(40ms)}, {at(10ms), at(20ms)}}), 0.040, kRounding);
}

TEST(TimeAccount, OverheadIsWhatNoPhysicsTakes) {
  const TimeAccount account = account_of({at(0ms), at(100ms)}, {{at(-10ms), at(40ms)}},
                                         {{at(50ms), at(80ms)}}, {{at(70ms), at(120ms)}});
  EXPECT_NEAR(account.wall_s, 0.100, kRounding);
  EXPECT_NEAR(account.axes_s, 0.040, kRounding);
  EXPECT_NEAR(account.exposures_s, 0.030, kRounding);
  EXPECT_NEAR(account.wire_s, 0.030, kRounding);
  EXPECT_NEAR(account.together_s, 0.090, kRounding);
  EXPECT_NEAR(account.overhead(), 0.10, kRounding);
}

TEST(TimeAccount, NothingTookNoTime) {
  const TimeAccount account = account_of({at(0ms), at(0ms)}, {}, {}, {});
  EXPECT_EQ(account.wall_s, 0.0);
  EXPECT_EQ(account.overhead(), 0.0);
}

TEST(AxisWatch, NotesHowLongAnAxisIsNotAtRest) {
  sim::SimOptions options =
      sim::nominal_options(std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.5)), 1);
  options.time_scale = 100.0;
  options.runs_by_itself = true;
  sim::SimGoniometer world(options);
  const AxisWatch watch(world);
  const auto start = world.clock().now();
  const auto settled = world.joint(0).start_homing(start);
  world.clock().wait_until(settled);
  const double travelled_s = devices::to_seconds(settled - start) / *options.time_scale;
  const auto deadline = std::chrono::steady_clock::now() + 10s;
  // The watch looks every millisecond, when the machine lets it.
  while (union_seconds(watch.intervals()) < travelled_s - 0.003 &&
         std::chrono::steady_clock::now() < deadline) {
    std::this_thread::yield();
  }
  ASSERT_EQ(watch.intervals().size(), 1U);
  EXPECT_GE(union_seconds(watch.intervals()), travelled_s - 0.003);
}

}  // namespace
}  // namespace gonio::emulate
