#include "gonio/sim/motion_profile.h"

#include <gtest/gtest.h>

#include <limits>

namespace gonio::sim {
namespace {

constexpr double kMotionRounding = 1e-12;

// v = 20 deg/s, a = 40 deg/s^2: full speed is reached after 0.5 s and 5 deg, so moves of 10 deg and
// less are triangles.

TEST(MotionProfile, ShortMoveTakesTwiceTheRootOfDistanceByAcceleration) {
  EXPECT_NEAR(MotionProfile::rest_to_rest(2.5, 20.0, 40.0).duration_s(), 0.5, kMotionRounding);
  EXPECT_NEAR(MotionProfile::rest_to_rest(10.0, 20.0, 40.0).duration_s(), 1.0, kMotionRounding);
}

TEST(MotionProfile, LongMoveTakesDistanceBySpeedAndOneRamp) {
  EXPECT_NEAR(MotionProfile::rest_to_rest(30.0, 20.0, 40.0).duration_s(), 2.0, kMotionRounding);
  EXPECT_NEAR(MotionProfile::rest_to_rest(-170.0, 20.0, 40.0).duration_s(), 9.0, kMotionRounding);
}

TEST(MotionProfile, LongMoveIsATrapezoidOfSpeed) {
  const MotionProfile move = MotionProfile::rest_to_rest(30.0, 20.0, 40.0);
  EXPECT_NEAR(move.position(0.25), 1.25, kMotionRounding);
  EXPECT_NEAR(move.speed(0.25), 10.0, kMotionRounding);
  EXPECT_NEAR(move.position(0.5), 5.0, kMotionRounding);
  EXPECT_NEAR(move.position(1.0), 15.0, kMotionRounding);
  EXPECT_NEAR(move.speed(1.0), 20.0, kMotionRounding);
  EXPECT_NEAR(move.position(1.5), 25.0, kMotionRounding);
  EXPECT_NEAR(move.position(1.75), 28.75, kMotionRounding);
  EXPECT_NEAR(move.speed(1.75), 10.0, kMotionRounding);
}

TEST(MotionProfile, FallingMoveMirrorsTheRisingOne) {
  const MotionProfile move = MotionProfile::rest_to_rest(-2.5, 20.0, 40.0);
  EXPECT_NEAR(move.position(0.25), -1.25, kMotionRounding);
  EXPECT_NEAR(move.speed(0.25), -10.0, kMotionRounding);
}

TEST(MotionProfile, StandsStillBeforeAndAfter) {
  const MotionProfile move = MotionProfile::rest_to_rest(7.3, 20.0, 40.0);
  EXPECT_EQ(move.position(-1.0), 0.0);
  EXPECT_EQ(move.speed(-1.0), 0.0);
  EXPECT_EQ(move.position(100.0), 7.3);
  EXPECT_EQ(move.speed(100.0), 0.0);
}

TEST(MotionProfile, NoDistanceTakesNoTime) {
  EXPECT_EQ(MotionProfile::rest_to_rest(0.0, 20.0, 40.0).duration_s(), 0.0);
  EXPECT_EQ(MotionProfile::braking(0.0, 40.0).duration_s(), 0.0);
}

TEST(MotionProfile, BrakingComesToRestByConstantDeceleration) {
  const MotionProfile brake = MotionProfile::braking(-20.0, 40.0);
  EXPECT_NEAR(brake.duration_s(), 0.5, kMotionRounding);
  EXPECT_NEAR(brake.position(0.25), -3.75, kMotionRounding);
  EXPECT_NEAR(brake.distance(), -5.0, kMotionRounding);
}

TEST(MotionProfile, RefusesWhatCannotMove) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(MotionProfile::rest_to_rest(1.0, 0.0, 40.0), std::invalid_argument);
  EXPECT_THROW(MotionProfile::rest_to_rest(1.0, 20.0, -1.0), std::invalid_argument);
  EXPECT_THROW(MotionProfile::rest_to_rest(kNan, 20.0, 40.0), std::invalid_argument);
  EXPECT_THROW(MotionProfile::braking(kNan, 40.0), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::sim
