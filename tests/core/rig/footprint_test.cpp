#include <gtest/gtest.h>

#include "rig_test_support.h"

namespace gonio::rig {
namespace {

using test::deg;

/// theta_o of an in-plane direction with theta_d = 20: theta_h + 20.
brdf::HalfDiff viewed_at(double theta_o_deg) {
  return half_diff_deg(theta_o_deg - 20.0, 20.0, 180.0);
}

std::optional<Reason> verdict(const FootprintLimits& footprint, double theta_o_deg) {
  RigDescription rig = la2(350.0, 500.0);
  rig.limits.footprint = footprint;
  return Inverse(rig, {false, false, false}).refusal_reason(viewed_at(theta_o_deg));
}

TEST(Footprint, IsNotCheckedWithoutASampleSize) {
  FootprintLimits f;
  f.spot_half_width_mm = 1000.0;
  EXPECT_EQ(verdict(f, 70.0), std::nullopt);
}

TEST(Footprint, SlantedSpotHasToStayOnTheSample) {
  FootprintLimits f;
  f.sample_half_width_mm = 25.0;
  f.edge_margin_mm = 5.0;
  f.spot_half_width_mm = 10.0;  // covers 20 mm at 60 deg: just fits
  EXPECT_EQ(verdict(f, 59.0), std::nullopt);
  EXPECT_EQ(verdict(f, 60.0), std::nullopt);
  EXPECT_EQ(verdict(f, 60.1), Reason::Footprint);
}

TEST(Footprint, ForeshortenedSampleHasToStayLargeEnough) {
  FootprintLimits f;
  f.sample_half_width_mm = 20.0;
  f.min_projected_half_width_mm = 10.0;
  EXPECT_EQ(verdict(f, 60.0), std::nullopt);
  EXPECT_EQ(verdict(f, 60.1), Reason::Footprint);
}

TEST(Footprint, UsableSampleHasToLieInTheCamerasField) {
  FootprintLimits f;
  f.sample_half_width_mm = 50.0;
  // Facing the camera at 350 mm the rim is seen at atan(50/350) = 8.13 deg; slanted, the near
  // rim comes closer, at most asin(50/350) = 8.21 deg.
  f.camera_half_field = deg(8.0);
  EXPECT_EQ(verdict(f, 20.0), Reason::Footprint);
  f.camera_half_field = deg(8.14);
  EXPECT_EQ(verdict(f, 20.0), Reason::Footprint);
  f.camera_half_field = deg(8.22);
  EXPECT_EQ(verdict(f, 20.0), std::nullopt);
  EXPECT_EQ(verdict(f, 75.0), std::nullopt);
}

TEST(Footprint, RefusalGivesTheFigures) {
  RigDescription rig = la2();
  rig.limits.footprint.sample_half_width_mm = 12.0;
  rig.limits.footprint.spot_half_width_mm = 6.0;
  const Reach reach = Inverse(rig, {false, false, false}).solve(viewed_at(70.0));
  ASSERT_TRUE(reach.refusal);
  EXPECT_EQ(to_string(reach.refusal->reason), "FOOTPRINT");
  EXPECT_NE(reach.refusal->detail.find("theta_o 70.00 deg leaves 4.10 mm"), std::string::npos)
      << reach.refusal->detail;
}

}  // namespace
}  // namespace gonio::rig
