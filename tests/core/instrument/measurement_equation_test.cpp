#include "gonio/instrument/measurement_equation.h"

#include <gtest/gtest.h>

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

TEST(WhiteReference, IsInterpolatedInItsTableAndHeldAtTheEnds) {
  WhiteReference white = example_instrument().white;
  EXPECT_NEAR(white_brdf(white, 70_deg)[0], 0.99 / std::numbers::pi, kRounding);
  white.angular = {{0.0, 1.02}, {40.0, 1.0}, {60.0, 0.9}};
  EXPECT_NEAR(white_brdf(white, 50_deg)[1], 0.985 * 0.95 / std::numbers::pi, kRounding);
  EXPECT_NEAR(white_brdf(white, 80_deg)[2], 0.98 * 0.9 / std::numbers::pi, kRounding);
}

TEST(LampField, IsMeasuredInTangentsFromTheLampAxis) {
  const LampField field{.c10 = 0.1, .c02 = -0.5};
  EXPECT_DOUBLE_EQ(relative_intensity(field, {0.0, 0.0, 500.0}), 1.0);
  EXPECT_NEAR(relative_intensity(field, {50.0, 100.0, 500.0}), 1.0 + 0.01 - 0.02, kRounding);
}

}  // namespace
}  // namespace gonio::instrument
