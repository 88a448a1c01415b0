#include "gonio/rig/travel.h"

#include <gtest/gtest.h>

#include "rig_test_support.h"

namespace gonio::rig {
namespace {

using test::deg;
using test::joints;

constexpr double kRounding_s = 1e-12;

TEST(Travel, ShortMovesNeverReachFullSpeed) {
  // 20 deg/s, 30 deg/s^2: full speed is reached after 6.67 deg, with as much to brake.
  EXPECT_NEAR(rest_to_rest_seconds(7.5, 20.0, 30.0), 1.0, kRounding_s);  // 2 sqrt(1/4)
  EXPECT_NEAR(rest_to_rest_seconds(-7.5, 20.0, 30.0), 1.0, kRounding_s);
  EXPECT_NEAR(rest_to_rest_seconds(100.0, 20.0, 30.0), 5.0 + 2.0 / 3.0, kRounding_s);
  EXPECT_NEAR(rest_to_rest_seconds(400.0 / 30.0, 20.0, 30.0), 4.0 / 3.0, kRounding_s);
  EXPECT_EQ(rest_to_rest_seconds(0.0, 20.0, 30.0), 0.0);
}

TEST(Travel, SlowestAxisDecidesAndSettles) {
  const TravelModel travel(la2());
  // Arm 100 deg: 5.667 s; tilt 10 deg at 10 deg/s, 20 deg/s^2: 1.5 s.
  EXPECT_NEAR(travel.seconds(joints({20.0, 0.0, 0.0}), joints({120.0, 0.0, 10.0})),
              5.0 + 2.0 / 3.0 + 0.3, kRounding_s);
  EXPECT_EQ(travel.seconds(joints({20.0, 1.0, 2.0}), joints({20.0, 1.0, 2.0})), 0.0);
}

TEST(Travel, OnlyAxesThatMovedSettle) {
  RigDescription rig = la2();
  rig.axes[0].settle = std::chrono::milliseconds(5000);
  const TravelModel travel(rig);
  EXPECT_NEAR(travel.seconds(joints({20.0, 0.0, 0.0}), joints({20.0, 0.0, 10.0})), 1.5 + 0.3,
              kRounding_s);
}

TEST(Travel, AxesOnASlowBusMoveOneAfterAnother) {
  RigDescription rig = la2();
  rig.simultaneous_axes = false;
  EXPECT_NEAR(TravelModel(rig).seconds(joints({20.0, 0.0, 0.0}), joints({120.0, 0.0, 10.0})),
              5.0 + 2.0 / 3.0 + 0.3 + 1.5 + 0.3, kRounding_s);
}

TEST(Travel, FallingMovesOvershootAndComeBack) {
  RigDescription rig = la2();
  rig.axes[0].approach_overshoot = deg(7.5);
  const TravelModel travel(rig);
  EXPECT_NEAR(travel.axis_seconds(0, deg(20.0), deg(120.0)), 5.0 + 2.0 / 3.0, kRounding_s);
  // Down 107.5 deg (6.04167 s), up 7.5 deg (1 s).
  EXPECT_NEAR(travel.axis_seconds(0, deg(120.0), deg(20.0)), 107.5 / 20.0 + 2.0 / 3.0 + 1.0,
              kRounding_s);
}

TEST(Travel, AxesThatWentPastComeBackTogetherOnceAllHaveSettled) {
  RigDescription rig = la2();
  rig.axes[0].approach_overshoot = deg(7.5);
  rig.axes[2].approach_overshoot = deg(2.5);
  const Joints from = joints({120.0, 0.0, 40.0});
  const Joints to = joints({110.0, 60.0, 30.0});
  // Azimuth 60 deg at 20 deg/s, 40 deg/s^2: 3.5 s, longer than arm (17.5 deg: 1.54 s) and tilt
  // (12.5 deg: 1.75 s); back is the arm's 7.5 deg (1 s), longer than the tilt's 2.5 deg (0.71 s).
  EXPECT_NEAR(TravelModel(rig).seconds(from, to), 3.5 + 0.3 + 1.0 + 0.3, kRounding_s);
  rig.simultaneous_axes = false;
  EXPECT_NEAR(
      TravelModel(rig).seconds(from, to),
      (17.5 / 20.0 + 20.0 / 30.0) + 1.0 + 3.5 + 1.75 + 2.0 * std::sqrt(2.5 / 20.0) + 5 * 0.3,
      kRounding_s);
}

TEST(Travel, KeepsTheTriangleInequality) {
  for (const double overshoot : {0.0, 3.0}) {
    RigDescription rig = la2();
    for (Axis& axis : rig.axes) axis.approach_overshoot = deg(overshoot);
    const TravelModel travel(rig);
    test::Random random(9);
    const auto pose = [&] {
      Joints q;
      for (const Axis& axis : rig.axes) {
        q.push_back(deg(random.uniform(axis.min.degrees() + 3.0, axis.max.degrees())));
      }
      return q;
    };
    for (int i = 0; i < 5000; ++i) {
      const Joints a = pose();
      const Joints b = pose();
      const Joints c = pose();
      EXPECT_LE(travel.seconds(a, c), travel.seconds(a, b) + travel.seconds(b, c) + kRounding_s);
    }
  }
}

TEST(Travel, RouteChargesTheWayAround) {
  RigDescription rig = la2();
  rig.keep_outs = {{"post", {{0, deg(60.0), deg(80.0)}, {2, deg(30.0), deg(90.0)}}}};
  const TravelModel travel(rig);
  const Joints from = joints({70.0, 0.0, 10.0});
  const Joints to = joints({90.0, 0.0, 40.0});
  const auto route = travel.route(from, to);
  ASSERT_TRUE(route);
  ASSERT_EQ(route->via.size(), 1u);
  EXPECT_NEAR(route->seconds,
              travel.seconds(from, route->via[0]) + travel.seconds(route->via[0], to), kRounding_s);
  EXPECT_GT(route->seconds, travel.seconds(from, to));
}

TEST(Travel, RefusesAWrongNumberOfJoints) {
  EXPECT_THROW(TravelModel(la2()).seconds(joints({1.0}), joints({2.0})), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::rig
