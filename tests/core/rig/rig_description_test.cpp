#include "gonio/rig/rig_description.h"

#include <gmock/gmock.h>

#include "rig_test_support.h"

namespace gonio::rig {
namespace {

using testing::HasSubstr;

std::string fault_of(const RigDescription& rig) {
  try {
    rig.validate();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "valid";
}

template <typename Spoil>
std::string fault_after(Spoil&& spoil) {
  RigDescription rig = la2();
  spoil(rig);
  return fault_of(rig);
}

TEST(RigDescription, ShippedRigIsValidAndStandsAtHome) {
  EXPECT_EQ(fault_of(la2()), "valid");
  EXPECT_EQ(la2().home(), test::joints({90.0, 0.0, 0.0}));
}

TEST(RigDescription, RefusalNamesTheAxisField) {
  EXPECT_THAT(fault_after([](auto& r) { r.axes.clear(); }), HasSubstr("axes: found none"));
  EXPECT_THAT(fault_after([](auto& r) { r.axes[1].name = ""; }), HasSubstr("axes[1].name"));
  EXPECT_THAT(fault_after([](auto& r) { r.axes[1].name = "tilt"; }),
              HasSubstr("axes[2].name: 'tilt' is there twice"));
  EXPECT_THAT(fault_after([](auto& r) { r.axes[0].min = test::deg(170); }),
              HasSubstr("axes[0].min: found 170"));
  EXPECT_THAT(fault_after([](auto& r) { r.axes[2].max_speed_deg_per_s = 0; }),
              HasSubstr("axes[2].max_speed_deg_per_s"));
  EXPECT_THAT(fault_after([](auto& r) { r.axes[2].acceleration_deg_per_s2 = NAN; }),
              HasSubstr("axes[2].acceleration_deg_per_s2: is not finite"));
  EXPECT_THAT(fault_after([](auto& r) { r.axes[0].home = test::deg(0); }),
              HasSubstr("axes[0].home: is outside"));
  EXPECT_THAT(fault_after([](auto& r) { r.axes[0].settle = std::chrono::milliseconds(-1); }),
              HasSubstr("axes[0].settle"));
  EXPECT_THAT(fault_after([](auto& r) { r.axes[0].approach_overshoot = test::deg(-1); }),
              HasSubstr("axes[0].approach_overshoot"));
}

TEST(RigDescription, RefusalNamesTheChainField) {
  EXPECT_THAT(fault_after([](auto& r) { r.lamp.links[0].axis = 3; }),
              HasSubstr("lamp.links[0].axis: found 3, but there are 3 axes"));
  EXPECT_THAT(fault_after([](auto& r) { r.sample.links[1].direction *= 1.01; }),
              HasSubstr("sample.links[1].direction: is not a unit vector"));
  EXPECT_THAT(fault_after([](auto& r) { r.sample.links[1].direction.setConstant(NAN); }),
              HasSubstr("sample.links[1].direction"));
  EXPECT_THAT(fault_after([](auto& r) { r.sample.links[0].scale = 0; }), HasSubstr("scale: is 0"));
  EXPECT_THAT(fault_after([](auto& r) { r.camera.home_pose.linear() *= 2.0; }),
              HasSubstr("camera.home_pose: is no rotation"));
  EXPECT_THAT(fault_after([](auto& r) { r.camera.home_pose.linear().col(0) *= -1.0; }),
              HasSubstr("camera.home_pose: is no rotation"));
}

TEST(RigDescription, RefusalNamesLimitsAndKeepOuts) {
  EXPECT_THAT(fault_after([](auto& r) { r.limits.theta_i_max = test::deg(95); }),
              HasSubstr("limits.theta_i_max: found 95"));
  EXPECT_THAT(fault_after([](auto& r) { r.limits.footprint.sample_half_width_mm = -1; }),
              HasSubstr("limits.footprint.sample_half_width_mm"));
  EXPECT_THAT(fault_after([](auto& r) {
                r.limits.footprint.sample_half_width_mm = 10;
                r.limits.footprint.edge_margin_mm = 10;
              }),
              HasSubstr("limits.footprint.edge_margin_mm"));
  EXPECT_THAT(fault_after([](auto& r) {
                r.keep_outs = {{"", {{0, Angle(), Angle()}}}};
              }),
              HasSubstr("keep_outs[0].name"));
  EXPECT_THAT(fault_after([](auto& r) {
                r.keep_outs = {{"post", {}}};
              }),
              HasSubstr("keep_outs[0].ranges: found none"));
  EXPECT_THAT(fault_after([](auto& r) {
                r.keep_outs = {{"post", {{7, Angle(), Angle()}}}};
              }),
              HasSubstr("keep_outs[0].ranges.axis: found 7"));
  EXPECT_THAT(fault_after([](auto& r) {
                r.keep_outs = {{"post", {{0, test::deg(2), test::deg(1)}}}};
              }),
              HasSubstr("keep_outs[0].ranges.min"));
}

TEST(RigDescription, ReferenceRigRefusesDistancesThatAreNone) {
  EXPECT_THROW(la2(0.0, 500.0), std::invalid_argument);
  EXPECT_THROW(la2(350.0, NAN), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::rig
