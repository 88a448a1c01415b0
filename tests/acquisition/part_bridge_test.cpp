#include "gonio/acquisition/part_bridge.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace gonio::acquisition {
namespace {

using testing::HasSubstr;

/// The same in all colours.
LevelChange change(double relative, double u) {
  return {brdf::Rgb::Constant(relative), brdf::Rgb::Constant(u * u)};
}

TEST(PartBridge, WhitesAloneAreTakenAsTheyAre) {
  const PartBridge bridge = bridge_parts(change(0.03, 0.001), std::nullopt, 0.0);
  EXPECT_DOUBLE_EQ(bridge.change_relative, 0.03);
  EXPECT_DOUBLE_EQ(bridge.u_relative, 0.001);
  EXPECT_FALSE(bridge.by_sentinel);
  EXPECT_TRUE(bridge.is_applied());
  EXPECT_FALSE(bridge.is_refused());
  EXPECT_THAT(to_text(bridge), HasSubstr("by whites alone; bridged"));
}

TEST(PartBridge, TheBetterKnownOneWeighsMore) {
  // Ten to one in variance: weights of 10/11 and 1/11.
  const PartBridge bridge =
      bridge_parts(change(0.030, 0.001), change(0.0311, 0.001 * std::sqrt(10.0)), 0.0);
  constexpr double kSecondOrder = 1e-7;  // a mean of factors is a geometric one
  EXPECT_NEAR(bridge.change_relative, 0.0301, kSecondOrder);
  EXPECT_NEAR(bridge.u_relative, 0.001 * std::sqrt(10.0 / 11.0), 1e-12);
  EXPECT_THAT(to_text(bridge), HasSubstr("by whites and sentinels; bridged"));
}

TEST(PartBridge, WhatTheMonitorIsOffByIsInBothAlike) {
  // Were it counted for each, two like ones would halve its square.
  constexpr double kMonitor = 0.002;
  const PartBridge bridge = bridge_parts(change(0.03, 1e-6), change(0.03, 1e-6), kMonitor);
  EXPECT_NEAR(bridge.u_relative, std::sqrt(2.0) * kMonitor, 1e-9);
  // And it excuses no difference between them.
  EXPECT_TRUE(bridge_parts(change(0.03, 1e-4), change(0.031, 1e-4), kMonitor).is_refused());
}

TEST(PartBridge, ThoseThatContradictEachOtherAreNoBridge) {
  // 3 u of the difference: 0.3 % x sqrt(2).
  for (const double apart : {0.0042, -0.0042}) {
    EXPECT_FALSE(bridge_parts(change(apart, 0.001), change(0.0, 0.001), 0.0).is_refused());
  }
  for (const double apart : {0.0043, -0.0043}) {
    const PartBridge refused = bridge_parts(change(apart, 0.001), change(0.0, 0.001), 0.0);
    EXPECT_TRUE(refused.is_refused());
    EXPECT_FALSE(refused.is_applied());
    EXPECT_DOUBLE_EQ(refused.disagreement_relative, apart);
    EXPECT_THAT(to_text(refused), HasSubstr("unbridged"));
  }
}

TEST(PartBridge, OneColourIsEnough) {
  LevelChange white = change(0.0, 0.001);
  white.relative[1] = -0.02;
  const PartBridge changed = bridge_parts(white, std::nullopt, 0.0);
  EXPECT_TRUE(changed.is_applied());
  EXPECT_DOUBLE_EQ(changed.change_relative, -0.02);
  EXPECT_TRUE(bridge_parts(white, change(0.0, 0.001), 0.0).is_refused());
}

TEST(PartBridge, NoiseIsNoChange) {
  const PartBridge bridge = bridge_parts(change(0.0015, 0.001), change(0.0005, 0.001), 0.0);
  EXPECT_FALSE(bridge.is_applied());
  EXPECT_FALSE(bridge.is_refused());
  EXPECT_THAT(to_text(bridge), HasSubstr("no factor is applied"));
}

}  // namespace
}  // namespace gonio::acquisition
