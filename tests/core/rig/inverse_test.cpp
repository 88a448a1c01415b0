// Limits and reason codes.
#include <gmock/gmock.h>

#include "gonio/brdf/merl_lattice.h"
#include "rig_test_support.h"

namespace gonio::rig {
namespace {

using test::deg;
using testing::HasSubstr;

/// Branch A only, so that the reason is unambiguous.
constexpr BranchSet kAlone{false, false, false};

Refusal refusal(const RigDescription& rig, const brdf::HalfDiff& d, BranchSet branches = kAlone) {
  const Reach reach = Inverse(rig, branches).solve(d);
  EXPECT_TRUE(reach.poses.empty());
  return reach.refusal.value_or(Refusal{Reason::NoInverse, "reachable"});
}

TEST(Inverse, ShippedRigReachesAllThePublishedTen) {
  const Inverse inverse(la2(), kAlone);
  for (const brdf::HalfDiff& d : test::kPublishedTen) {
    const Reach reach = inverse.solve(d);
    EXPECT_EQ(reach.poses.size(), 1u) << d.theta_h.degrees() << " " << d.theta_d.degrees();
    EXPECT_FALSE(reach.refusal);
  }
}

TEST(Inverse, RefusesTheSeedReportsDirectionBelowTheHorizon) {
  const Refusal r = refusal(la2(), half_diff_deg(2.84, 89.0, 15.0));
  EXPECT_EQ(to_string(r.reason), "BELOW_HORIZON");
  EXPECT_THAT(r.detail, HasSubstr("theta_i 91.7"));
}

TEST(Inverse, TellsGrazingLightFromGrazingView) {
  // phi_d = 0 tilts the half vector away from the light: theta_i = theta_h + theta_d.
  const Refusal in = refusal(la2(), half_diff_deg(35.0, 50.0, 0.0));
  EXPECT_EQ(to_string(in.reason), "GRAZING_IN");
  EXPECT_THAT(in.detail, HasSubstr("theta_i 85.00 deg, at most 80.01"));
  const Refusal out = refusal(la2(), half_diff_deg(35.0, 50.0, 180.0));
  EXPECT_EQ(to_string(out.reason), "GRAZING_OUT");
  EXPECT_THAT(out.detail, HasSubstr("theta_o 85.00 deg"));
}

TEST(Inverse, ReciprocalPoseServesWhereOnlyOneSideMayGraze) {
  RigDescription rig = la2();
  rig.limits.theta_i_max = deg(60.0);
  const brdf::HalfDiff d = half_diff_deg(10.0, 60.0, 0.0);  // theta_i 70, theta_o 50
  EXPECT_EQ(refusal(rig, d).reason, Reason::GrazingIn);
  const Reach reach = Inverse(rig, {true, false, false}).solve(d);
  ASSERT_EQ(reach.poses.size(), 1u);
  EXPECT_EQ(to_char(reach.poses[0].branch), 'C');
}

TEST(Inverse, RefusesALampInFrontOfTheCamera) {
  const Refusal r = refusal(la2(), half_diff_deg(20.0, 3.0, 90.0));
  EXPECT_EQ(to_string(r.reason), "OCCLUDED_LAMP");
  EXPECT_THAT(r.detail, HasSubstr("theta_d 3.00 deg, at least 3.75"));
}

TEST(Inverse, NamesTheAxisAtItsLimit) {
  RigDescription rig = la2();
  rig.axes[2].max = deg(40.0);
  const Refusal r = refusal(rig, half_diff_deg(50.0, 20.0, 89.0));
  EXPECT_EQ(to_string(r.reason), "AXIS_LIMIT");
  EXPECT_THAT(r.detail, HasSubstr("tilt 49.99 deg, allowed -5.00 to 40.00"));
}

TEST(Inverse, NamesTheKeepOut) {
  RigDescription rig = la2();
  rig.keep_outs = {{"cradle post", {{0, deg(30.0), deg(50.0)}, {2, deg(10.0), deg(90.0)}}}};
  const Refusal r = refusal(rig, half_diff_deg(20.0, 20.0, 90.0));  // lamp_arm 40, tilt 20
  EXPECT_EQ(to_string(r.reason), "KEEP_OUT");
  EXPECT_EQ(r.detail, "cradle post");
  EXPECT_FALSE(Inverse(rig, kAlone).solve(half_diff_deg(5.0, 20.0, 90.0)).poses.empty());
}

TEST(Inverse, LimitsAreInclusive) {
  RigDescription rig = la2();
  rig.limits.theta_o_max = deg(80.0);
  // (2, 60, 180): exactly on theta_o = 62; (5, 75, 180): theta_o = 80 up to rounding.
  EXPECT_FALSE(Inverse(rig, kAlone).solve(half_diff_deg(5.0, 75.0, 180.0)).poses.empty());
  rig.limits.theta_o_max = deg(80.0 - 1e-6);
  EXPECT_EQ(refusal(rig, half_diff_deg(5.0, 75.0, 180.0)).reason, Reason::GrazingOut);

  rig = la2();
  rig.limits.theta_d_min = deg(4.0);
  EXPECT_FALSE(Inverse(rig, kAlone).solve(half_diff_deg(15.0, 4.0, 130.0)).poses.empty());

  rig = la2();
  rig.axes[0].max = deg(158.0);
  EXPECT_FALSE(Inverse(rig, kAlone).solve(half_diff_deg(2.0, 79.0, 110.0)).poses.empty());
  rig.axes[0].max = deg(158.0 - 1e-6);
  EXPECT_EQ(refusal(rig, half_diff_deg(2.0, 79.0, 110.0)).reason, Reason::AxisLimit);
}

TEST(Inverse, OtherSideServesALampArmMountedTheOtherWay) {
  RigDescription rig = la2();
  rig.axes[0].min = deg(-165.0);
  rig.axes[0].max = deg(-7.5);
  rig.axes[0].home = deg(-90.0);
  rig.axes[2].min = deg(-70.0);
  EXPECT_EQ(refusal(rig, half_diff_deg(5.0, 40.0, 70.0)).reason, Reason::AxisLimit);
  const Reach reach = Inverse(rig, {true, true, false}).solve(half_diff_deg(5.0, 40.0, 70.0));
  ASSERT_EQ(reach.poses.size(), 2u);
  EXPECT_EQ(branch_name(reach.poses[0]), "B");
  EXPECT_EQ(branch_name(reach.poses[1]), "D");
}

TEST(Inverse, CheapTestAgreesWithTheFullSolution) {
  RigDescription rig = la2();
  rig.keep_outs = {{"post", {{0, deg(60.0), deg(90.0)}, {1, deg(20.0), deg(90.0)}}}};
  for (const bool reciprocal : {false, true}) {
    const Inverse inverse(rig, {reciprocal, false, false});
    test::Random random(5);
    int reachable = 0;
    for (int i = 0; i < 5000; ++i) {
      const brdf::HalfDiff d =
          half_diff_deg(random.uniform(0, 90), random.uniform(0, 90), random.uniform(-180, 180));
      const Reach reach = inverse.solve(d);
      EXPECT_EQ(inverse.maybe_reachable(d), !reach.poses.empty());
      EXPECT_EQ(inverse.refusal_reason(d).has_value(), reach.refusal.has_value());
      if (reach.refusal) {
        EXPECT_EQ(inverse.refusal_reason(d), reach.refusal->reason);
      } else {
        ++reachable;
      }
    }
    EXPECT_GT(reachable, 500);
  }
}

TEST(Inverse, ThrowsForWhatIsNoDirection) {
  const Inverse inverse(la2());
  EXPECT_THROW(inverse.solve(half_diff_deg(-1.0, 20.0, 0.0)), std::invalid_argument);
  EXPECT_THROW(inverse.solve(half_diff_deg(10.0, 91.0, 0.0)), std::invalid_argument);
  EXPECT_THROW(inverse.solve(half_diff_deg(10.0, NAN, 0.0)), std::invalid_argument);
  EXPECT_THROW(inverse.solve(half_diff_deg(10.0, 20.0, INFINITY)), std::invalid_argument);
}

TEST(Inverse, RefusesAnInvalidRig) {
  RigDescription rig = la2();
  rig.axes.clear();
  EXPECT_THROW(Inverse{rig}, std::invalid_argument);
}

TEST(Inverse, ReasonsHaveTheirPublishedNames) {
  EXPECT_EQ(to_string(Reason::NoInverse), "NO_IK");
  EXPECT_EQ(to_string(Reason::Footprint), "FOOTPRINT");
  EXPECT_EQ(to_string(Reason::PathBlocked), "PATH_BLOCKED");
}

}  // namespace
}  // namespace gonio::rig
