#include "gonio/units/angle.h"

#include <gtest/gtest.h>

#include <numbers>

namespace gonio {
namespace {

using namespace gonio::literals;

constexpr double kRounding = 1e-15;

TEST(Angle, ConvertsBetweenDegreesAndRadians) {
  EXPECT_NEAR(Angle::from_degrees(180.0).radians(), std::numbers::pi, kRounding);
  EXPECT_NEAR(Angle::from_radians(std::numbers::pi / 6.0).degrees(), 30.0, 1e-14);
  EXPECT_EQ((90_deg).radians(), (90.0_deg).radians());
}

TEST(Angle, AddsAndScalesLikeANumber) {
  EXPECT_NEAR((30_deg + 15_deg * 2.0 - 20_deg / 4.0).degrees(), 55.0, 1e-13);
  EXPECT_NEAR(90_deg / 30_deg, 3.0, kRounding);
  EXPECT_EQ(-(10_deg), -10.0 * (1_deg));
  Angle sum = 1_deg;
  sum += 2_deg;
  sum -= 0.5_deg;
  EXPECT_NEAR(sum.degrees(), 2.5, 1e-14);
}

TEST(Angle, ComparesByValue) {
  EXPECT_LT(-5_deg, 5_deg);
  EXPECT_EQ(abs(-5_deg), 5_deg);
  EXPECT_GE(5_deg, 5_deg);
}

TEST(Angle, HasTheTrigonometryOfItsValue) {
  EXPECT_NEAR(sin(30_deg), 0.5, kRounding);
  EXPECT_NEAR(cos(60_deg), 0.5, kRounding);
  EXPECT_NEAR(tan(45_deg), 1.0, kRounding);
}

TEST(Angle, WrapsIntoTheHalfTurnEitherSideWithTheUpperEndIncluded) {
  EXPECT_NEAR(wrap_to_half_turn(190_deg).degrees(), -170.0, 1e-12);
  EXPECT_NEAR(wrap_to_half_turn(-190_deg).degrees(), 170.0, 1e-12);
  EXPECT_NEAR(wrap_to_half_turn(725_deg).degrees(), 5.0, 1e-12);
  EXPECT_EQ(wrap_to_half_turn(-180_deg).degrees(), 180.0);
  EXPECT_EQ(wrap_to_half_turn(180_deg).degrees(), 180.0);
}

}  // namespace
}  // namespace gonio
