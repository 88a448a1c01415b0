#include "light_curve.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gonio::acquisition {
namespace {

constexpr double kU = 0.001;

/// The same in all colours.
LightCurve::Reading reading(double time_s, double level) {
  return {time_s, brdf::Rgb::Constant(level), brdf::Rgb::Constant(kU * kU)};
}

TEST(LightCurve, BeyondItsReadingsAStepWasOnceAndADriftGoesOn) {
  const LightCurve even({reading(0.0, 1.0), reading(10.0, 1.01), reading(20.0, 1.02)});
  EXPECT_NEAR(even.level(30.0)[0], 1.03, 1e-12);
  EXPECT_NEAR(even.level(-10.0)[0], 0.99, 1e-12);
  for (const double step : {0.03, -0.03}) {
    const LightCurve stepped({reading(0.0, 1.0), reading(10.0, 1.0), reading(20.0, 1.0 + step)});
    EXPECT_NEAR(stepped.level(30.0)[0], 1.0 + step, 1e-12);
    EXPECT_NEAR(stepped.level(15.0)[0], 1.0 + step / 2.0, 1e-12);
  }
}

TEST(LightCurve, IsAsUncertainAsItsReadingsWhereTheLightIsSteady) {
  const LightCurve steady({reading(0.0, 1.0), reading(10.0, 1.0), reading(20.0, 1.0)});
  EXPECT_NEAR(steady.at(10.0).variance[0], kU * kU, 1e-12);
  EXPECT_NEAR(steady.at(15.0).variance[0], kU * kU / 2.0, 1e-12) << "a mean of two";
  // The last one, and a slope of the first two.
  EXPECT_NEAR(steady.at(30.0).variance[0], 3.0 * kU * kU, 1e-12);
}

TEST(LightCurve, KnowsAnEvenDriftBetweenItsReadingsAndNotBeyond) {
  const LightCurve even(
      {reading(0.0, 1.0), reading(10.0, 1.02), reading(20.0, 1.04), reading(30.0, 1.06)});
  EXPECT_LT(std::sqrt(even.at(15.0).variance[0]), kU);
  // None or twice of 2 % in 10 s.
  EXPECT_NEAR(std::sqrt(even.at(40.0).variance[0]), 0.02 / 1.06 / std::sqrt(3.0), 0.002);
}

TEST(LightCurve, MayHaveGoneBeyondAsNextToIt) {
  const LightCurve slower(
      {reading(0.0, 1.0), reading(10.0, 1.04), reading(20.0, 1.04), reading(30.0, 1.04)});
  EXPECT_NEAR(slower.level(-10.0)[0], 1.0, 1e-12) << "as most of the time";
  EXPECT_NEAR(std::sqrt(slower.at(-10.0).variance[0]), 0.04 / std::sqrt(3.0), 0.001);
  EXPECT_LT(std::sqrt(slower.at(40.0).variance[0]), 3.0 * kU) << "noise alone";
}

TEST(LightCurve, DoesNotKnowWhereInASegmentAStepWas) {
  const LightCurve stepped(
      {reading(0.0, 1.0), reading(10.0, 1.0), reading(20.0, 1.04), reading(30.0, 1.04)});
  // Either 2 % too high or too low.
  EXPECT_NEAR(std::sqrt(stepped.at(15.0).variance[0]), 0.02, 1e-4);
  EXPECT_LT(std::sqrt(stepped.at(5.0).variance[0]), kU);
  const LightCurve alone({reading(0.0, 1.0), reading(10.0, 1.04)});
  EXPECT_NEAR(std::sqrt(alone.at(5.0).variance[0]), 0.02, 1e-4) << "may be step or drift";
}

TEST(LightCurve, ChangesBetweenTwoTimesWithoutTheNoiseOfBoth) {
  const LightCurve even({reading(0.0, 1.0), reading(10.0, 1.001), reading(20.0, 1.002)});
  const LevelChange near = even.change(19.0, 20.0);
  EXPECT_NEAR(near.relative[0], 0.0001, 1e-6);
  EXPECT_NEAR(std::sqrt(near.variance[0]), 0.1 * std::sqrt(2.0) * kU, 1e-6);
}

TEST(LightCurve, LeavesOutWhatIsNotLater) {
  const LightCurve same({reading(5.0, 1.0), reading(5.0, 2.0)});
  EXPECT_FALSE(same.shows_drift());
  EXPECT_EQ(same.level(7.0)[1], 1.0);
  EXPECT_EQ(same.at(7.0).variance[1], kU * kU);
}

}  // namespace
}  // namespace gonio::acquisition
