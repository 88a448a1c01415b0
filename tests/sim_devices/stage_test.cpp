#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <thread>

#include "worlds.h"

namespace gonio::sim {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;

// True angles pass through a few sums of radians.
constexpr double kRoundingDeg = 1e-9;

/// One perfect axis of 20 deg/s, 40 deg/s^2, 0.3 s of settling; its peculiarities as wished.
SimOptions world_with(const AxisOptions& azimuth) {
  SimOptions options = ideal_options(0.5);
  options.axes[kAzimuth] = azimuth;
  options.rig.axes[kAzimuth].max_speed_deg_per_s = 20.0;
  options.rig.axes[kAzimuth].acceleration_deg_per_s2 = 40.0;
  options.rig.axes[kAzimuth].settle = 300ms;
  return options;
}

AxisOptions perfect_axis() { return ideal_options(0.5).axes[kAzimuth]; }

double true_deg(const SimGoniometer& world) { return world.true_joints()[kAzimuth].degrees(); }

TEST(SimRotationStage, TakesTheTimeOfATrapezoidAndSettling) {
  SimGoniometer world(world_with(perfect_axis()));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  const auto start = world.clock().now();
  stage.begin_move_to(30.0_deg);
  EXPECT_EQ(world.clock().now(), start);  // begun, no time passed
  stage.wait_until_settled(kPatience);
  // 30/20 + 20/40 s, then 0.3 s
  EXPECT_EQ((world.clock().now() - start), 2300ms);
}

TEST(SimRotationStage, AxesTravelTogether) {
  SimGoniometer world(ideal_options(0.5));
  home(world);
  const auto start = world.clock().now();
  world.stage(kLampArm).begin_move_to(10.0_deg);
  world.stage(kAzimuth).begin_move_to(10.0_deg);
  world.stage(kLampArm).wait_until_settled(kPatience);
  const auto after_long = world.clock().now();
  EXPECT_GT(after_long, start);
  world.stage(kAzimuth).wait_until_settled(kPatience);
  EXPECT_EQ(world.clock().now(), after_long);
}

TEST(SimRotationStage, HoldingItsTargetTakesNoTime) {
  SimGoniometer world(world_with(perfect_axis()));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  stage.begin_move_to(30.0_deg);
  stage.wait_until_settled(kPatience);
  const auto start = world.clock().now();
  stage.begin_move_to(30.0_deg);
  stage.wait_until_settled(kPatience);
  EXPECT_EQ(world.clock().now(), start);
}

TEST(SimRotationStage, IsHalfWayAtHalfTime) {
  SimGoniometer world(world_with(perfect_axis()));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  const auto start = world.clock().now();
  stage.begin_move_to(30.0_deg);
  world.clock().wait_until(start + 250ms);
  EXPECT_NEAR(true_deg(world), 1.25, kRoundingDeg);
  world.clock().wait_until(start + 1s);
  EXPECT_NEAR(true_deg(world), 15.0, kRoundingDeg);
}

TEST(SimRotationStage, StopBrakesWithTheAxisDeceleration) {
  SimGoniometer world(world_with(perfect_axis()));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  const auto start = world.clock().now();
  stage.begin_move_to(60.0_deg);
  world.clock().wait_until(start + 1s);  // at 15 deg with 20 deg/s
  stage.stop();
  world.clock().wait_until(start + 10s);
  EXPECT_NEAR(true_deg(world), 20.0, kRoundingDeg);
  stage.rearm();
  EXPECT_NEAR(stage.wait_until_settled(kPatience).degrees(), 20.0, kRoundingDeg);
}

TEST(SimRotationStage, NewTargetIsReachedFromWhereTheOldMoveBrakes) {
  SimGoniometer world(world_with(perfect_axis()));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  const auto start = world.clock().now();
  stage.begin_move_to(60.0_deg);
  world.clock().wait_until(start + 1s);
  stage.begin_move_to(10.0_deg);  // brakes to 20 deg in 0.5 s, then 10 deg back in 1 s
  world.clock().wait_until(start + 1250ms);
  EXPECT_NEAR(true_deg(world), 18.75, kRoundingDeg);  // 15 + 20 / 4 - 20 / 16
  stage.wait_until_settled(kPatience);
  EXPECT_NEAR(true_deg(world), 10.0, kRoundingDeg);
  EXPECT_EQ(world.clock().now() - start, 1s + 500ms + 1s + 300ms);
}

TEST(SimRotationStage, StopWhileBrakingForANewTargetCancelsIt) {
  SimGoniometer world(world_with(perfect_axis()));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  const auto start = world.clock().now();
  stage.begin_move_to(60.0_deg);
  world.clock().wait_until(start + 1s);
  stage.begin_move_to(-60.0_deg);
  world.clock().wait_until(start + 1250ms);
  stage.stop();
  world.clock().wait_until(start + 1min);
  EXPECT_NEAR(true_deg(world), 20.0, kRoundingDeg);
}

TEST(SimRotationStage, BacklashShowsAsHysteresisTheEncoderDoesNotSee) {
  AxisOptions axis = perfect_axis();
  axis.backlash = 0.08_deg;
  SimGoniometer world(world_with(axis));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  const auto reported_and_true = [&](Angle from) {
    stage.begin_move_to(from);
    stage.wait_until_settled(kPatience);
    stage.begin_move_to(30.0_deg);
    const double reported = stage.wait_until_settled(kPatience).degrees();
    return std::pair(reported, true_deg(world));
  };
  const auto rising = reported_and_true(20.0_deg);
  const auto falling = reported_and_true(40.0_deg);
  EXPECT_NEAR(rising.first, 30.0, kRoundingDeg);
  EXPECT_NEAR(falling.first, 30.0, kRoundingDeg);
  EXPECT_NEAR(rising.second, 29.96, kRoundingDeg);
  EXPECT_NEAR(falling.second, 30.04, kRoundingDeg);
}

TEST(SimRotationStage, MoveWithinThePlayLeavesTheShaftWhereItIs) {
  AxisOptions axis = perfect_axis();
  axis.backlash = 0.08_deg;
  SimGoniometer world(world_with(axis));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  for (const Angle target : {30.0_deg, 29.95_deg}) {
    stage.begin_move_to(target);
    stage.wait_until_settled(kPatience);
  }
  EXPECT_NEAR(true_deg(world), 29.96, kRoundingDeg);
}

TEST(SimRotationStage, EncoderReportsWholeSteps) {
  AxisOptions axis = perfect_axis();
  axis.encoder_step = 0.25_deg;
  SimGoniometer world(world_with(axis));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  stage.begin_move_to(10.1_deg);
  EXPECT_NEAR(stage.wait_until_settled(kPatience).degrees(), 10.0, kRoundingDeg);
  EXPECT_NEAR(true_deg(world), 10.1, kRoundingDeg);
}

TEST(SimRotationStage, ZeroOffsetAndEccentricityAddToTheTrueAngle) {
  AxisOptions axis = perfect_axis();
  axis.zero_offset = 0.5_deg;
  axis.eccentricity_cos = 0.02_deg;
  axis.eccentricity_sin = 0.04_deg;
  SimGoniometer world(world_with(axis));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  stage.begin_move_to(30.0_deg);
  EXPECT_NEAR(stage.wait_until_settled(kPatience).degrees(), 30.0, kRoundingDeg);
  // cos 30 = 0.8660254038, sin 30 = 0.5
  EXPECT_NEAR(true_deg(world), 30.0 + 0.5 + 0.02 * 0.8660254038 + 0.02, kRoundingDeg);
}

TEST(SimRotationStage, RingsAfterArrivalAndThenStandsStill) {
  AxisOptions axis = perfect_axis();
  axis.ring_fraction = 0.01;
  axis.ring_limit = 0.05_deg;
  axis.ring_hz = 25.0;
  SimGoniometer world(world_with(axis));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  const auto start = world.clock().now();
  stage.begin_move_to(30.0_deg);
  // 10 ms after arrival is a quarter of the period, e^(-10/40) = 0.7788008
  world.clock().wait_until(start + 2010ms);
  EXPECT_NEAR(true_deg(world), 30.0 + 0.05 * 0.7788007831, kRoundingDeg);
  stage.wait_until_settled(kPatience);
  EXPECT_NEAR(true_deg(world), 30.0, kRoundingDeg);
}

TEST(SimRotationStage, PositioningErrorIsSeenByTheEncoderAndScattersAsAsked) {
  AxisOptions axis = perfect_axis();
  axis.positioning_sigma = 0.01_deg;
  SimGoniometer world(world_with(axis));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  constexpr int kMoves = 400;
  double sum = 0.0;
  double squares = 0.0;
  for (int move = 0; move < kMoves; ++move) {
    const Angle target = move % 2 == 0 ? 10.0_deg : 0.0_deg;
    stage.begin_move_to(target);
    const Angle reported = stage.wait_until_settled(kPatience);
    EXPECT_NEAR(reported.degrees(), true_deg(world), kRoundingDeg);
    const double error = (reported - target).degrees();
    sum += error;
    squares += error * error;
  }
  // Four standard errors of a mean and of a standard deviation over 400 values.
  EXPECT_NEAR(sum / kMoves, 0.0, 0.002);
  EXPECT_NEAR(std::sqrt(squares / kMoves), 0.01, 0.0015);
}

TEST(SimRotationStage, HomingScattersUnseen) {
  AxisOptions axis = perfect_axis();
  axis.homing_sigma = 0.01_deg;
  SimGoniometer world(world_with(axis));
  auto& stage = world.stage(kAzimuth);
  constexpr int kHomings = 200;
  double squares = 0.0;
  for (int homing = 0; homing < kHomings; ++homing) {
    stage.home(kPatience);
    EXPECT_NEAR(stage.wait_until_settled(kPatience).degrees(), 0.0, kRoundingDeg);
    squares += true_deg(world) * true_deg(world);
  }
  EXPECT_NEAR(std::sqrt(squares / kHomings), 0.01, 0.002);  // four standard errors
}

TEST(SimRotationStage, HomesToTheHomeAngleOfTheRig) {
  SimOptions options = ideal_options(0.5);
  options.rig.axes[kLampArm].home = 90.0_deg;
  SimGoniometer world(options);
  world.stage(kLampArm).home(kPatience);
  EXPECT_NEAR(world.stage(kLampArm).wait_until_settled(kPatience).degrees(), 90.0, kRoundingDeg);
  EXPECT_NEAR(world.true_joints()[kLampArm].degrees(), 90.0, kRoundingDeg);
}

TEST(SimRotationStage, StandsSomewhereElseAfterEveryPowerUp) {
  SimOptions options = ideal_options(0.5);
  options.seed = 1;
  const Angle first = SimGoniometer(options).true_joints()[kAzimuth];
  options.seed = 2;
  const Angle second = SimGoniometer(options).true_joints()[kAzimuth];
  EXPECT_NE(first, second);
  for (const Angle angle : {first, second}) {
    EXPECT_GE(angle, options.rig.axes[kAzimuth].min);
    EXPECT_LE(angle, options.rig.axes[kAzimuth].max);
  }
}

TEST(SimRotationStage, TimeoutLetsItsTimePassAndTheMoveGoOn) {
  SimGoniometer world(world_with(perfect_axis()));
  auto& stage = world.stage(kAzimuth);
  stage.home(kPatience);
  const auto start = world.clock().now();
  stage.begin_move_to(30.0_deg);
  EXPECT_THROW(stage.wait_until_settled(1000ms), DeviceError);
  EXPECT_EQ(world.clock().now() - start, 1s);
  EXPECT_NEAR(stage.wait_until_settled(1300ms).degrees(), 30.0, kRoundingDeg);
}

TEST(SimRotationStage, StopFromAnotherThreadEndsAPacedWait) {
  AxisOptions axis = perfect_axis();
  axis.index_search = 10min;  // far longer than any test may take
  SimOptions options = world_with(axis);
  options.time_scale = 1.0;
  SimGoniometer world(options);
  auto& stage = world.stage(kAzimuth);
  std::thread other([&] {
    while (world.clock().now() == 0ns) std::this_thread::yield();
    stage.stop();
  });
  try {
    stage.home(kPatience);
    ADD_FAILURE() << "it homed as if nobody had stopped the axis";
  } catch (const DeviceError& error) {
    EXPECT_EQ(error.code(), DeviceErrc::Stopped);
  }
  other.join();
  EXPECT_LT(world.clock().now(), 10min);
  stage.rearm();
  EXPECT_THROW(stage.begin_move_to(1.0_deg), DeviceError);  // not homed
}

}  // namespace
}  // namespace gonio::sim
