#include "gonio/brdf/directions.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <random>
#include <stdexcept>

namespace gonio::brdf {
namespace {

using namespace gonio::literals;

/// What a few dozen roundings leave of a unit vector.
constexpr double kUnitRounding = 1e-14;
/// Required of the round trip up to theta_d = 89 deg, where the half vector keeps 2 % of its length
/// and with it all but two digits.
constexpr double kRoundTrip = 1e-12;

Eigen::Vector3d random_unit_vector(std::mt19937_64& generator) {
  std::normal_distribution<double> normal;
  return Eigen::Vector3d(normal(generator), normal(generator), normal(generator)).normalized();
}

double distance(const DirectionPair& a, const DirectionPair& b) {
  return std::max((a.wi - b.wi).norm(), (a.wo - b.wo).norm());
}

TEST(Directions, PointAlongTheAxesTheyName) {
  EXPECT_LT((direction(0.0_deg, 77.0_deg) - Eigen::Vector3d::UnitZ()).norm(), kUnitRounding);
  EXPECT_LT((direction(90.0_deg, 0.0_deg) - Eigen::Vector3d::UnitX()).norm(), kUnitRounding);
  EXPECT_LT((direction(90.0_deg, 90.0_deg) - Eigen::Vector3d::UnitY()).norm(), kUnitRounding);
}

TEST(HalfDiff, RoundTripsTwentyThousandRandomPairsInDirectionSpace) {
  std::mt19937_64 generator(1);
  int pairs = 0;
  double worst = 0.0;
  while (pairs < 20'000) {
    const DirectionPair pair{random_unit_vector(generator), random_unit_vector(generator)};
    const HalfDiff angles = half_diff_from_directions(pair);
    if (angles.theta_d > 89.0_deg) continue;
    worst = std::max(worst, distance(directions_from_half_diff(angles), pair));
    ++pairs;
  }
  EXPECT_LT(worst, kRoundTrip);
}

TEST(HalfDiff, RoundTripsCloseToItsPoles) {
  std::mt19937_64 generator(2);
  std::uniform_real_distribution<double> exponent(-17.0, 0.0);
  std::uniform_real_distribution<double> turn(-180.0, 180.0);
  double worst = 0.0;
  for (int i = 0; i < 20'000; ++i) {
    const HalfDiff angles{Angle::from_radians(std::pow(10.0, exponent(generator))),
                          Angle::from_radians(std::pow(10.0, exponent(generator))),
                          Angle::from_degrees(turn(generator)),
                          Angle::from_degrees(turn(generator))};
    const DirectionPair pair = directions_from_half_diff(angles);
    const DirectionPair back = directions_from_half_diff(half_diff_from_directions(pair));
    worst = std::max(worst, distance(back, pair));
  }
  EXPECT_LT(worst, kRoundTrip);
}

TEST(HalfDiff, KeepsSmallAnglesToTheirLastDigits) {
  // An arc cosine would return 0 or 1.5e-8 here.
  const HalfDiff angles{Angle::from_radians(1e-9), Angle::from_radians(3e-10), 40.0_deg, 0.0_deg};
  const HalfDiff found = half_diff_from_directions(directions_from_half_diff(angles));
  EXPECT_NEAR(found.theta_h.radians(), 1e-9, 1e-16);
  EXPECT_NEAR(found.theta_d.radians(), 3e-10, 1e-16);
}

TEST(HalfDiff, GivesTheAnglesOfPairsKnownByHand) {
  // Light at 60 deg and detector at 0 in the plane of x: h halfway, light on the +x side of it.
  const HalfDiff plane =
      half_diff_from_directions({direction(60.0_deg, 0.0_deg), direction(0.0_deg, 0.0_deg)});
  EXPECT_NEAR(plane.theta_h.degrees(), 30.0, 1e-12);
  EXPECT_NEAR(plane.theta_d.degrees(), 30.0, 1e-12);
  EXPECT_NEAR(plane.phi_d.degrees(), 0.0, 1e-12);
  // Light and detector at right angles to the plane of h: y is where phi_d is +90.
  const HalfDiff across =
      half_diff_from_directions({Eigen::Vector3d(0.0, 0.6, 0.8), Eigen::Vector3d(0.0, -0.6, 0.8)});
  EXPECT_NEAR(across.theta_h.degrees(), 0.0, 1e-12);
  EXPECT_NEAR(across.theta_d.degrees(), std::asin(0.6) * 180.0 / M_PI, 1e-12);
  EXPECT_NEAR(across.phi_d.degrees(), 90.0, 1e-12);
}

TEST(HalfDiff, CountsPhiDCounterClockwiseSeenFromTheHalfVector) {
  const DirectionPair pair = directions_from_half_diff({40.0_deg, 20.0_deg, 30.0_deg, 10.0_deg});
  const Eigen::Vector3d h = (pair.wi + pair.wo).normalized();
  const Eigen::Vector3d away_from_normal = h * h.z() - Eigen::Vector3d::UnitZ();
  // The light sits 30 deg counter-clockwise of the direction in which theta_h grows.
  EXPECT_GT(h.dot(away_from_normal.cross(pair.wi)), 0.0);
  EXPECT_GT(away_from_normal.dot(pair.wi - pair.wo), 0.0);
}

TEST(HalfDiff, SwappingDirectionsShiftsPhiDByHalfATurn) {  // Helmholtz reciprocity
  std::mt19937_64 generator(3);
  for (int i = 0; i < 2'000; ++i) {
    const DirectionPair pair{random_unit_vector(generator), random_unit_vector(generator)};
    const HalfDiff forward = half_diff_from_directions(pair);
    const HalfDiff swapped = half_diff_from_directions({pair.wo, pair.wi});
    EXPECT_EQ(swapped.theta_h.radians(), forward.theta_h.radians());
    EXPECT_EQ(swapped.theta_d.radians(), forward.theta_d.radians());
    EXPECT_NEAR(std::abs((forward.phi_d - swapped.phi_d).degrees()), 180.0, 1e-9);
  }
}

TEST(HalfDiff, IgnoresATurnAboutTheNormalButForPhiH) {
  const DirectionPair pair{direction(50.0_deg, 20.0_deg), direction(35.0_deg, 140.0_deg)};
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd((73.0_deg).radians(), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const HalfDiff before = half_diff_from_directions(pair);
  const HalfDiff after = half_diff_from_directions({turn * pair.wi, turn * pair.wo});
  EXPECT_NEAR(after.theta_h.degrees(), before.theta_h.degrees(), 1e-12);
  EXPECT_NEAR(after.theta_d.degrees(), before.theta_d.degrees(), 1e-12);
  EXPECT_NEAR(after.phi_d.degrees(), before.phi_d.degrees(), 1e-12);
  EXPECT_NEAR((after.phi_h - before.phi_h).degrees(), 73.0, 1e-12);
}

TEST(HalfDiff, FlipsTheSignOfPhiDInAMirror) {
  const DirectionPair pair{direction(50.0_deg, 20.0_deg), direction(35.0_deg, 140.0_deg)};
  const Eigen::DiagonalMatrix<double, 3> mirror(1.0, -1.0, 1.0);
  const HalfDiff before = half_diff_from_directions(pair);
  const HalfDiff after = half_diff_from_directions({mirror * pair.wi, mirror * pair.wo});
  EXPECT_NEAR(after.phi_d.degrees(), -before.phi_d.degrees(), 1e-12);
}

TEST(HalfDiff, IsZeroWhereAnAzimuthIsUndefined) {
  const HalfDiff mirror =
      half_diff_from_directions({Eigen::Vector3d(0.6, 0.0, 0.8), Eigen::Vector3d(-0.6, 0.0, 0.8)});
  EXPECT_EQ(mirror.phi_h.radians(), 0.0);
  const Eigen::Vector3d same = direction(40.0_deg, 100.0_deg);
  const HalfDiff retro = half_diff_from_directions({same, same});
  EXPECT_EQ(retro.theta_d.radians(), 0.0);
  EXPECT_EQ(retro.phi_d.radians(), 0.0);
}

TEST(HalfDiff, ReportsAHalfTurnAsPlus180) {
  const HalfDiff angles =
      half_diff_from_directions({Eigen::Vector3d(-0.6, -0.0, 0.8), Eigen::Vector3d(0.6, 0.0, 0.8)});
  EXPECT_EQ(angles.phi_d.degrees(), 180.0);
}

TEST(HalfDiff, RefusesVectorsThatAreNoDirections) {
  const Eigen::Vector3d z = Eigen::Vector3d::UnitZ();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(half_diff_from_directions({z * 1.00001, z}), std::invalid_argument);
  EXPECT_THROW(half_diff_from_directions({z, z * 0.9}), std::invalid_argument);
  EXPECT_THROW(half_diff_from_directions({z, Eigen::Vector3d(nan, 0.0, 1.0)}),
               std::invalid_argument);
  EXPECT_THROW(half_diff_from_directions({z, -z}), std::invalid_argument);
  EXPECT_NO_THROW(half_diff_from_directions({z * (1.0 + 5e-7), z}));
}

TEST(PolarCosines, AreTheHeightsOfTheDirections) {
  std::mt19937_64 generator(4);
  for (int i = 0; i < 2'000; ++i) {
    const DirectionPair pair{random_unit_vector(generator), random_unit_vector(generator)};
    const HalfDiff angles = half_diff_from_directions(pair);
    if (angles.theta_d > 89.0_deg) continue;
    const PolarCosines cosines = polar_cosines(angles.theta_h, angles.theta_d, angles.phi_d);
    EXPECT_NEAR(cosines.cos_theta_i, pair.wi.z(), kRoundTrip);
    EXPECT_NEAR(cosines.cos_theta_o, pair.wo.z(), kRoundTrip);
  }
}

TEST(AboveHorizon, MeansThatBothDirectionsHavePositiveHeight) {
  std::mt19937_64 generator(5);
  int above = 0;
  int decided = 0;
  for (int i = 0; i < 20'000; ++i) {
    DirectionPair pair{random_unit_vector(generator), random_unit_vector(generator)};
    if ((pair.wi + pair.wo).z() < 0.0) pair = {-pair.wi, -pair.wo};  // theta_h in [0, 90]
    const double lower = std::min(pair.wi.z(), pair.wo.z());
    if (std::abs(lower) < kRoundTrip) continue;
    const HalfDiff angles = half_diff_from_directions(pair);
    EXPECT_EQ(above_horizon(angles.theta_h, angles.theta_d, angles.phi_d), lower > 0.0);
    above += lower > 0.0 ? 1 : 0;
    ++decided;
  }
  EXPECT_GT(above, decided / 10);
  EXPECT_LT(above, decided * 9 / 10);
}

TEST(AboveHorizon, EqualsTheClosedForm) {  // |cos phi_d| tan theta_h tan theta_d < 1
  std::mt19937_64 generator(6);
  std::uniform_real_distribution<double> quarter(0.0, 90.0);
  for (int i = 0; i < 20'000; ++i) {
    const Angle h = Angle::from_degrees(quarter(generator));
    const Angle d = Angle::from_degrees(quarter(generator));
    const Angle p = Angle::from_degrees(2.0 * quarter(generator));
    const double product = std::abs(cos(p)) * tan(h) * tan(d);
    if (std::abs(product - 1.0) < 1e-9) continue;
    EXPECT_EQ(above_horizon(h, d, p), product < 1.0);
  }
}

TEST(AboveHorizon, IsFalseInTheHorizonPlaneItself) {
  EXPECT_FALSE(above_horizon(90.0_deg, 0.0_deg, 0.0_deg));
  EXPECT_FALSE(above_horizon(0.0_deg, 90.0_deg, 0.0_deg));
  EXPECT_FALSE(above_horizon(30.0_deg, 60.0_deg, 0.0_deg));
  EXPECT_FALSE(above_horizon(30.0_deg, 60.0_deg, 180.0_deg));
  EXPECT_TRUE(above_horizon(30.0_deg, 60.0_deg, 1.0_deg));
}

TEST(AboveHorizon, RefusesTheSeedReportsImpossibleDirection) {
  // (2.84, 89, 15) deg has theta_i = 91.74 deg (docs/results.md).
  EXPECT_FALSE(above_horizon(2.84_deg, 89.0_deg, 15.0_deg));
  const PolarCosines cosines = polar_cosines(2.84_deg, 89.0_deg, 15.0_deg);
  EXPECT_NEAR(std::acos(cosines.cos_theta_i) * 180.0 / M_PI, 91.74, 0.005);
}

}  // namespace
}  // namespace gonio::brdf
