#include "gonio/instrument/measurement_equation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "example_instrument.h"

namespace gonio::instrument {
namespace {

using namespace gonio::literals;

constexpr double kRounding = 1e-12;

TEST(MeasurementEquation, GivesTheHandComputedFactorAtTheCentre) {
  // Lamp arm 60, sample turned 20 towards it: theta_o = 20, theta_i = 40, 500 mm.
  const Instrument instrument = example_instrument();
  const rig::RigPose pose = rig::forward(instrument.rig, {60_deg, 20_deg, 0_deg});
  const auto centre = pixel_geometry(instrument, pose, 159.5, 127.5);
  ASSERT_TRUE(centre);
  EXPECT_NEAR(centre->point_in_sample_mm.norm(), 0.0, 1e-9);
  EXPECT_NEAR(centre->factor, 0.76604444311897804 / 250000.0, kRounding);  // cos 40 / 500^2
  EXPECT_NEAR(centre->directions.wo.z(), 0.93969262078590838, kRounding);  // cos 20
}

TEST(MeasurementEquation, SeesTheSampleMarkWhereTheCameraDoes) {
  // Head on, a point 25 mm along the sample's x lies 25 / 350 * 1400 = 100 px from the centre.
  const Instrument instrument = example_instrument();
  const rig::RigPose pose = rig::forward(instrument.rig, {60_deg, 0_deg, 0_deg});
  const auto pixel = pixel_of_point(instrument, pose, {25.0, 0.0, 0.0});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(std::abs(pixel->x() - 159.5), 100.0, 1e-9);
  EXPECT_NEAR(pixel->y(), 127.5, 1e-9);
  const auto back = pixel_geometry(instrument, pose, pixel->x(), pixel->y());
  ASSERT_TRUE(back);
  EXPECT_NEAR((back->point_in_sample_mm - Eigen::Vector3d(25.0, 0.0, 0.0)).norm(), 0.0, 1e-9);
}

TEST(MeasurementEquation, HasNoValueWhenTheLampIsBehindThePlane) {
  const Instrument instrument = example_instrument();
  const rig::RigPose pose = rig::forward(instrument.rig, {160_deg, 0_deg, 0_deg});
  EXPECT_FALSE(pixel_geometry(instrument, pose, 159.5, 127.5));
}

TEST(MeasurementEquation, DropsTheDistanceForACollimatedLamp) {
  Instrument instrument = example_instrument();
  instrument.rig.collimated_lamp = true;
  const rig::RigPose pose = rig::forward(instrument.rig, {60_deg, 20_deg, 0_deg});
  EXPECT_NEAR(pixel_geometry(instrument, pose, 159.5, 127.5)->factor, 0.76604444311897804,
              kRounding);
}

TEST(Vignetting, IsOneAtThePrincipalPointAndFollowsItsPolynomialInTheField) {
  Instrument instrument = example_instrument();
  instrument.vignetting = {-2.0, 3.0, 0.0};
  EXPECT_DOUBLE_EQ(relative_response(instrument, 159.5, 127.5), 1.0);
  // 140 px of 1400 px focal length: q = 0.01, V = 1 - 0.02 + 0.0003
  EXPECT_NEAR(relative_response(instrument, 159.5 + 140.0, 127.5), 0.9803, kRounding);
}

/// Light at azimuth 17 deg, the detector `delta_phi_deg` further.
brdf::DirectionPair pair_deg(double theta_i_deg, double theta_o_deg, double delta_phi_deg) {
  const auto at = [](double theta_deg, double phi_deg) {
    const double theta = Angle::from_degrees(theta_deg).radians();
    const double phi = Angle::from_degrees(phi_deg).radians();
    return Eigen::Vector3d(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi),
                           std::cos(theta));
  };
  return {at(theta_i_deg, 17.0), at(theta_o_deg, 17.0 + delta_phi_deg)};
}

TEST(HalfVectorSigma, IsHowFarHTurnsWhenTheLampDoes) {
  Instrument instrument = example_instrument();
  instrument.u_normal = Angle();
  instrument.u_lamp_direction = 0.01_deg;
  // By moving wi by that much in either direction across it.
  for (const double theta_d_deg : {0.0, 40.0, 75.0}) {
    const double theta = Angle::from_degrees(theta_d_deg).radians();
    const Eigen::Vector3d wi(std::sin(theta), 0.0, std::cos(theta));
    const Eigen::Vector3d wo(-std::sin(theta), 0.0, std::cos(theta));
    const Eigen::Vector3d in_plane(std::cos(theta), 0.0, -std::sin(theta));
    double squares = 0.0;
    for (const Eigen::Vector3d& way : {in_plane, Eigen::Vector3d(0.0, 1.0, 0.0)}) {
      const Eigen::Vector3d moved = wi + instrument.u_lamp_direction.radians() * way;
      squares += ((moved + wo).normalized() - (wi + wo).normalized()).squaredNorm();
    }
    EXPECT_NEAR(half_vector_sigma(instrument, Angle::from_degrees(theta_d_deg)).radians(),
                std::sqrt(0.5 * squares), 1e-8);
  }
  instrument.u_normal = 0.03_deg;
  EXPECT_NEAR(half_vector_sigma(instrument, Angle()).degrees(), std::hypot(0.03, 0.005), 1e-9);
}

TEST(WhiteReference, IsInterpolatedInItsTableAndHeldAtTheEnds) {
  WhiteReference white = example_instrument().white;
  EXPECT_NEAR(white_brdf(white, pair_deg(70, 10, 0))[0], 0.99 / std::numbers::pi, kRounding);
  white.angular = AngularTable::of_incidence({0.0, 40.0, 60.0}, {1.02, 1.0, 0.9});
  EXPECT_NEAR(white_brdf(white, pair_deg(50, 80, 33))[1], 0.985 * 0.95 / std::numbers::pi,
              kRounding);
  EXPECT_NEAR(white_brdf(white, pair_deg(80, 5, 170))[2], 0.98 * 0.9 / std::numbers::pi, kRounding);
}

TEST(WhiteReference, LooksAtLightDetectorAndTheAngleBetween) {
  WhiteReference white;
  // Every node a number of its own: digits are the nodes' places.
  white.angular = {{20.0, 60.0}, {10.0, 30.0, 70.0}, {0.0, 120.0}, {}};
  for (const double i : {1.0, 2.0}) {
    for (const double o : {0.1, 0.2, 0.4}) {
      for (const double p : {0.0, 0.03}) white.angular.factor.push_back(i + o + p);
    }
  }
  const auto factor = [&](double theta_i, double theta_o, double phi) {
    return white_brdf(white, pair_deg(theta_i, theta_o, phi))[0] * std::numbers::pi;
  };
  EXPECT_NEAR(factor(20, 10, 0), 1.1, kRounding);
  EXPECT_NEAR(factor(60, 30, 120), 2.23, kRounding);
  EXPECT_NEAR(factor(30, 50, 40), 1.25 + 0.3 + 0.01, kRounding);
  EXPECT_NEAR(factor(30, 50, -40), 1.56, kRounding) << "either side";
  EXPECT_NEAR(factor(30, 50, 320), 1.56, kRounding);
  EXPECT_NEAR(factor(85, 5, 180), 2.0 + 0.1 + 0.03, kRounding) << "held beyond the ends";
  EXPECT_NEAR(factor(0, 30, 90), 1.2, kRounding) << "no azimuth on the normal";
}

TEST(LampField, IsMeasuredInTangentsFromTheLampAxis) {
  const LampField field{.c10 = 0.1, .c02 = -0.5};
  EXPECT_DOUBLE_EQ(relative_intensity(field, {0.0, 0.0, 500.0}), 1.0);
  EXPECT_NEAR(relative_intensity(field, {50.0, 100.0, 500.0}), 1.0 + 0.01 - 0.02, kRounding);
}

}  // namespace
}  // namespace gonio::instrument
