#include "gonio/sim/angular_white.h"

#include <gtest/gtest.h>

#include <numbers>

#include "gonio/brdf/directions.h"

namespace gonio::sim {
namespace {

using namespace gonio::literals;

constexpr double kTableRounding = 1e-9;

AngularFactor table() {
  return {{0.0_deg, 60.0_deg},
          {0.0_deg, 60.0_deg},
          {0.0_deg, 180.0_deg},
          {1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.4, 1.2}};
}

double factor(Angle theta_i, Angle theta_o, Angle delta_phi) {
  const AngularWhite white(brdf::Rgb::Constant(0.5), table());
  const brdf::Rgb value = white.evaluate(brdf::DirectionPair{
      brdf::direction(theta_i, 20.0_deg), brdf::direction(theta_o, 20.0_deg + delta_phi)});
  return value[1] * std::numbers::pi / 0.5;
}

TEST(AngularWhite, TakesItsNodesAsTheyStand) {
  EXPECT_NEAR(factor(0.0_deg, 60.0_deg, 0.0_deg), 1.0, kTableRounding);
  EXPECT_NEAR(factor(60.0_deg, 60.0_deg, 0.0_deg), 1.4, 1e-6);  // arc cosine at its flat end
  EXPECT_NEAR(factor(60.0_deg, 60.0_deg, 180.0_deg), 1.2, 1e-6);
}

TEST(AngularWhite, InterpolatesInAllThreeAngles) {
  EXPECT_NEAR(factor(60.0_deg, 60.0_deg, 90.0_deg), 1.3, kTableRounding);
  EXPECT_NEAR(factor(30.0_deg, 60.0_deg, 90.0_deg), 1.15, kTableRounding);
  EXPECT_NEAR(factor(30.0_deg, 30.0_deg, 90.0_deg), 1.075, kTableRounding);
}

TEST(AngularWhite, HoldsTheLastNodeBeyondTheTable) {
  EXPECT_NEAR(factor(75.0_deg, 80.0_deg, 90.0_deg), 1.3, kTableRounding);
}

TEST(AngularWhite, IsBlackFromBelow) {
  const AngularWhite white(brdf::Rgb::Constant(0.99), table());
  const brdf::DirectionPair below{brdf::direction(100.0_deg, 0.0_deg),
                                  brdf::direction(10.0_deg, 0.0_deg)};
  EXPECT_EQ(white.evaluate(below)[0], 0.0);
}

TEST(AngularWhite, RefusesATableThatIsNone) {
  const auto built = [](AngularFactor bad) { AngularWhite(brdf::Rgb::Constant(0.99), bad); };
  AngularFactor bad = table();
  bad.factor.pop_back();
  EXPECT_THROW(built(bad), std::invalid_argument);
  bad = table();
  bad.factor[0] = -1.0;
  EXPECT_THROW(built(bad), std::invalid_argument);
  bad = table();
  bad.theta_o = {60.0_deg, 0.0_deg};
  EXPECT_THROW(built(bad), std::invalid_argument);
  bad = table();
  bad.delta_phi.clear();
  EXPECT_THROW(built(bad), std::invalid_argument);
  EXPECT_THROW(AngularWhite(brdf::Rgb::Constant(1.1), table()), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::sim
