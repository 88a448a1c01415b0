#include "gonio/rig/paths.h"

#include <gmock/gmock.h>

#include "rig_test_support.h"

namespace gonio::rig {
namespace {

using test::deg;
using test::joints;
using testing::ElementsAre;

/// A post between lamp arm 60..80 deg that a sample tilted beyond 30 deg would hit.
RigDescription rig_with_post() {
  RigDescription rig = la2();
  rig.keep_outs = {{"post", {{0, deg(60.0), deg(80.0)}, {2, deg(30.0), deg(90.0)}}}};
  return rig;
}

TEST(Paths, KeepOutBordersBelongToIt) {
  const RigDescription rig = rig_with_post();
  EXPECT_EQ(keep_out_at(rig, joints({60.0, 0.0, 30.0})), "post");
  EXPECT_EQ(keep_out_at(rig, joints({59.9, 0.0, 30.0})), std::nullopt);
  EXPECT_EQ(keep_out_at(rig, joints({70.0, 0.0, 29.9})), std::nullopt);
}

TEST(Paths, MarginWidensKeepOutsForPosesAndWays) {
  const RigDescription rig = rig_with_post();
  EXPECT_EQ(keep_out_at(rig, joints({59.9, 0.0, 40.0}), deg(0.2)), "post");
  EXPECT_EQ(keep_out_at(rig, joints({59.9, 0.0, 40.0}), deg(0.05)), std::nullopt);
  const Joints from = joints({59.9, 0.0, 40.0});
  const Joints to = joints({50.0, 0.0, 40.0});
  EXPECT_TRUE(path_is_clear(rig, from, to));
  EXPECT_FALSE(path_is_clear(rig, from, to, deg(0.2)));
  EXPECT_FALSE(way_around(rig, from, to, deg(0.2)));
}

TEST(Paths, KeepOutAcrossTheWayBlocksItThoughBothEndsAreFree) {
  const RigDescription rig = rig_with_post();
  EXPECT_FALSE(path_is_clear(rig, joints({50.0, 0.0, 40.0}), joints({90.0, 0.0, 40.0})));
  EXPECT_TRUE(path_is_clear(rig, joints({50.0, 0.0, 20.0}), joints({90.0, 0.0, 20.0})));
  EXPECT_EQ(keep_out_between(rig, joints({50.0, 0.0, 40.0}), joints({90.0, 0.0, 40.0})), "post");
}

TEST(Paths, WhatTheTimingOfTheAxesMightTouchCounts) {
  // Arm first is free, tilt first is not: together nobody knows.
  RigDescription rig = rig_with_post();
  const Joints from = joints({70.0, 0.0, 10.0});
  const Joints to = joints({90.0, 0.0, 40.0});
  EXPECT_FALSE(path_is_clear(rig, from, to));
  rig.simultaneous_axes = false;  // the arm moves first
  EXPECT_TRUE(path_is_clear(rig, from, to));
  EXPECT_FALSE(path_is_clear(rig, to, joints({70.0, 0.0, 10.0})));
}

TEST(Paths, OvershootOfAOneSidedApproachCounts) {
  RigDescription rig = rig_with_post();
  const Joints from = joints({100.0, 0.0, 40.0});
  const Joints to = joints({81.0, 0.0, 40.0});
  EXPECT_TRUE(path_is_clear(rig, from, to));
  rig.axes[0].approach_overshoot = deg(2.0);
  EXPECT_FALSE(path_is_clear(rig, from, to));
}

TEST(Paths, OvershootIsForFallingMovesAndEndsAtTheLimit) {
  Axis axis = la2().axes[0];  // from 7.5 deg
  axis.approach_overshoot = deg(2.0);
  EXPECT_EQ(overshoot(axis, deg(20.0), deg(30.0)), Angle());
  EXPECT_EQ(overshoot(axis, deg(30.0), deg(20.0)), deg(2.0));
  EXPECT_NEAR(overshoot(axis, deg(30.0), deg(8.5)).degrees(), 1.0, 1e-12);
  EXPECT_EQ(overshoot(axis, deg(30.0), deg(7.5)), Angle());
}

TEST(Paths, WayAroundMovesAxisByAxisWhenThatHelps) {
  const RigDescription rig = rig_with_post();
  const Joints from = joints({70.0, 0.0, 10.0});
  const auto way = way_around(rig, from, joints({90.0, 0.0, 40.0}));
  ASSERT_TRUE(way);
  EXPECT_THAT(*way, ElementsAre(joints({90.0, 0.0, 10.0})));
  EXPECT_THAT(way_around(rig, from, joints({90.0, 0.0, 20.0})).value(), ElementsAre());
}

TEST(Paths, WayAroundGoesHomeWhenThatHelpsAndEveryLegIsClear) {
  const RigDescription rig = rig_with_post();  // home: 90, 0, 0
  const Joints from = joints({50.0, 0.0, 40.0});
  const Joints to = joints({90.0, 10.0, 40.0});
  const auto way = way_around(rig, from, to);
  ASSERT_TRUE(way);
  EXPECT_FALSE(way->empty());
  Joints at = from;
  for (const Joints& stop : *way) {
    EXPECT_TRUE(path_is_clear(rig, at, stop));
    at = stop;
  }
  EXPECT_TRUE(path_is_clear(rig, at, to));
}

TEST(Paths, NoWayIntoACage) {
  RigDescription rig = rig_with_post();
  rig.keep_outs = {{"wall", {{1, deg(20.0), deg(30.0)}}}};
  EXPECT_FALSE(way_around(rig, rig.home(), joints({90.0, 40.0, 0.0})));
}

TEST(Paths, RefusesAWrongNumberOfJoints) {
  EXPECT_THROW(keep_out_at(la2(), joints({1.0})), std::invalid_argument);
  EXPECT_THROW(path_is_clear(la2(), joints({1.0}), la2().home()), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::rig
