// Rigs that are no ideal LA-2: product of exponentials and numeric inverse.
#include <gtest/gtest.h>

#include <numbers>

#include "gonio/rig/dh_import.h"
#include "rig_test_support.h"

namespace gonio::rig {
namespace {

using test::deg;

// A pose counts as a solution below 1e-9; compared with the direction once more from outside.
constexpr double kSolved = 2e-9;
// Closed forms against products of matrices.
constexpr double kClosedForm = 1e-12;

/// The reference rig as a bad day in the workshop leaves it: axes 0.5 deg off and skew by 1 mm,
/// zero marks 0.5 deg off, camera, lamp and sample displaced by 1 mm.
RigDescription misaligned_la2(test::Random& random) {
  RigDescription rig = test::unlimited_la2();
  const auto bend = [&](ChainLink& link) {
    link.direction = (link.direction + random.vector(0.5 * std::numbers::pi / 180.0)).normalized();
    link.point_mm += random.vector(1.0);
    link.offset = deg(random.uniform(-0.5, 0.5));
  };
  for (ChainLink& link : rig.lamp.links) bend(link);
  for (ChainLink& link : rig.sample.links) bend(link);
  for (Chain* chain : {&rig.camera, &rig.lamp, &rig.sample}) {
    chain->home_pose.translation() += random.vector(1.0);
  }
  return rig;
}

TEST(NumericInverse, SolvesFourHundredMisalignedRigs) {
  test::Random random(400);
  int failures = 0;
  double worst = 0.0;
  double farthest_deg = 0.0;
  for (int i = 0; i < 400; ++i) {
    RigDescription rig = misaligned_la2(random);
    rig.limits.theta_i_max = rig.limits.theta_o_max = deg(82.0);
    rig.limits.theta_d_min = deg(3.0);
    const Inverse inverse(rig, {true, false, false});
    ASSERT_FALSE(inverse.closed_form());
    brdf::HalfDiff d = test::random_direction(random, 80.0);
    while (!inverse.maybe_reachable(d)) d = test::random_direction(random, 80.0);
    const Reach reach = inverse.solve(d);
    if (reach.poses.size() != 2) ++failures;
    for (const PoseSolution& pose : reach.poses) {
      worst =
          std::max(worst, test::difference(test::nominal(rig, pose.joints), test::wanted(d, pose)));
      const auto ideal = test::nominal(test::unlimited_la2(), pose.joints);
      farthest_deg = std::max(
          farthest_deg, test::difference(ideal, test::wanted(d, pose)) * 180.0 / std::numbers::pi);
    }
  }
  EXPECT_EQ(failures, 0);
  EXPECT_LT(worst, kSolved);
  EXPECT_GT(farthest_deg, 0.5);  // the rigs were misaligned indeed
}

TEST(NumericInverse, AgreesWithTheClosedFormOnANearlyIdealRig) {
  RigDescription rig = test::unlimited_la2();
  rig.lamp.links[0].offset = Angle::from_radians(1e-11);
  rig.sample.links[0].direction = Eigen::Vector3d(1e-11, 0.0, 1.0);
  const Inverse numeric(rig, {true, true, false});
  const Inverse closed(test::unlimited_la2(), {true, true, false});
  ASSERT_FALSE(numeric.closed_form());
  test::Random random(8);
  for (int i = 0; i < 200; ++i) {
    const brdf::HalfDiff d = test::random_direction(random, 75.0);
    if (d.theta_d < deg(2.0)) continue;  // at alpha = 0 azimuth and tilt are not unique
    const Reach a = numeric.solve(d);
    const Reach b = closed.solve(d);
    ASSERT_EQ(a.poses.size(), b.poses.size());
    for (std::size_t p = 0; p < a.poses.size(); ++p) {
      for (std::size_t k = 0; k < 3; ++k) {
        // 1e-9 of the residual, amplified towards grazing.
        EXPECT_NEAR((a.poses[p].joints[k] - b.poses[p].joints[k]).radians(), 0.0, 1e-7);
      }
    }
  }
}

TEST(NumericInverse, ReportsTheAxisLimitOfABentRig) {
  test::Random random(3);
  RigDescription rig = misaligned_la2(random);
  rig.axes[2].max = deg(30.0);
  const Reach reach = Inverse(rig, {false, false, false}).solve(half_diff_deg(50.0, 20.0, 89.0));
  ASSERT_TRUE(reach.refusal);
  EXPECT_EQ(reach.refusal->reason, Reason::AxisLimit);
}

TEST(NumericInverse, GivesUpWithAReasonWhereTheRigHasTooFewAxes) {
  RigDescription rig = test::unlimited_la2();
  rig.sample.links.pop_back();
  rig.axes.pop_back();  // in-plane only
  const Inverse inverse(rig);
  const Reach out_of_plane = inverse.solve(half_diff_deg(30.0, 20.0, 90.0));
  ASSERT_TRUE(out_of_plane.refusal);
  EXPECT_EQ(to_string(out_of_plane.refusal->reason), "NO_IK");
  const Reach in_plane = inverse.solve(half_diff_deg(30.0, 20.0, 180.0));
  ASSERT_FALSE(in_plane.poses.empty());
  EXPECT_LT(test::difference(test::nominal(rig, in_plane.poses[0].joints),
                             brdf::directions_from_half_diff(half_diff_deg(30.0, 20.0, 180.0))),
            kSolved);
}

/// A six-axis arm (proportions of a common small robot) that holds the sample in front of a fixed
/// camera, lamp on a ring.
RigDescription robot_rig() {
  RigDescription rig;
  rig.name = "robot";
  for (int i = 0; i < 7; ++i) {
    Axis axis;
    axis.name = "axis" + std::to_string(i);
    axis.min = deg(-170.0);
    axis.max = deg(170.0);
    rig.axes.push_back(axis);
  }
  const double a[] = {25.0, 455.0, 35.0, 0.0, 0.0, 0.0};
  const double alpha[] = {-90.0, 0.0, -90.0, 90.0, -90.0, 0.0};
  const double d[] = {400.0, 0.0, 0.0, 420.0, 0.0, 80.0};
  const double theta[] = {0.0, -90.0, 0.0, 0.0, 0.0, 0.0};
  std::vector<DhRow> rows;
  for (std::size_t i = 0; i < 6; ++i) {
    DhRow row;
    row.a_mm = a[i];
    row.alpha = deg(alpha[i]);
    row.d_mm = d[i];
    row.theta = deg(theta[i]);
    row.axis = i;
    rows.push_back(row);
  }
  rig.sample = chain_from_dh(rows, DhConvention::classic);
  rig.camera.home_pose.translation() = Eigen::Vector3d(1500.0, 0.0, 800.0);
  ChainLink ring;
  ring.axis = 6;
  ring.direction = Eigen::Vector3d::UnitZ();
  ring.point_mm = Eigen::Vector3d(600.0, 0.0, 0.0);
  rig.lamp.links = {ring};
  rig.lamp.home_pose.translation() = Eigen::Vector3d(1600.0, 0.0, 900.0);
  rig.limits.theta_d_min = Angle();
  return rig;
}

TEST(NumericInverse, FindsPosesOfARedundantRobotWithinItsLimits) {
  const RigDescription rig = robot_rig();
  const Inverse inverse(rig, {false, false, false});
  test::Random random(66);
  int tried = 0;
  while (tried < 40) {
    Joints q;
    for (const Axis& axis : rig.axes) {
      q.push_back(deg(random.uniform(axis.min.degrees(), axis.max.degrees())));
    }
    const auto pair = test::nominal(rig, q);
    if (pair.wi.z() < 0.2 || pair.wo.z() < 0.2) continue;  // shown by this pose, so it exists
    ++tried;
    const brdf::HalfDiff d = brdf::half_diff_from_directions(pair);
    const Reach reach = inverse.solve(d);
    ASSERT_FALSE(reach.poses.empty()) << reach.refusal->detail;
    const Joints& found = reach.poses[0].joints;
    EXPECT_LT(test::difference(test::nominal(rig, found), pair), kSolved);
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_LE(abs(found[k]), deg(170.0) + Angle::from_radians(1e-9));
    }
  }
}

TEST(NumericInverse, DrivesASlide) {
  // The lamp rides on a straight rail instead of an arm: 5 mm per turn of its screw.
  RigDescription rig = test::unlimited_la2();
  rig.lamp.links[0].direction = Eigen::Vector3d::UnitY();
  rig.lamp.links[0].lead_mm_per_turn = 5.0;
  rig.axes[0].min = deg(0.0);
  rig.axes[0].max = deg(360.0 * 200.0);  // 1 m
  rig.axes[0].home = deg(360.0 * 20.0);
  Joints q = rig.home();
  q[0] = deg(360.0 * 10.0);
  const Eigen::Vector3d lamp = forward(rig, q).world_from_lamp.translation();
  EXPECT_NEAR((lamp - Eigen::Vector3d(500.0, 50.0, 0.0)).norm(), 0.0, 1e-9);

  const brdf::HalfDiff d = half_diff_deg(15.0, 20.0, 60.0);  // 40 deg aside: 420 mm along the rail
  const Reach reach = Inverse(rig, {false, false, false}).solve(d);
  ASSERT_FALSE(reach.poses.empty()) << reach.refusal->detail;
  EXPECT_LT(test::difference(test::nominal(rig, reach.poses[0].joints),
                             brdf::directions_from_half_diff(d)),
            kSolved);
  EXPECT_NEAR(reach.poses[0].joints[0].degrees() / 360.0 * 5.0,
              500.0 * std::tan(40.0 * std::numbers::pi / 180.0), 1e-4);
}

TEST(Chains, ExchangingLampAndCameraExchangesTheDirections) {  // Helmholtz
  test::Random random(12);
  for (int i = 0; i < 50; ++i) {
    const RigDescription rig = misaligned_la2(random);
    RigDescription swapped = rig;
    std::swap(swapped.lamp, swapped.camera);
    const Joints q =
        test::joints({random.uniform(10, 150), random.uniform(-40, 60), random.uniform(5, 40)});
    const auto pair = test::nominal(rig, q);
    if (pair.wi.z() <= 0.05 || pair.wo.z() <= 0.05) continue;
    const auto other = test::nominal(swapped, q);
    const brdf::HalfDiff a = brdf::half_diff_from_directions(pair);
    const brdf::HalfDiff b = brdf::half_diff_from_directions(other);
    EXPECT_NEAR(a.theta_h.radians(), b.theta_h.radians(), kClosedForm);
    EXPECT_NEAR(a.theta_d.radians(), b.theta_d.radians(), kClosedForm);
    EXPECT_NEAR(std::abs((a.phi_d - b.phi_d).degrees()), 180.0, 1e-9);
  }
}

/// The rig seen in a mirror at y = 0: screws turn the other way round.
Chain mirrored(const Chain& chain) {
  const Eigen::Vector3d mirror(1.0, -1.0, 1.0);
  Chain result = chain;
  for (ChainLink& link : result.links) {
    link.direction = -(mirror.asDiagonal() * link.direction);
    link.point_mm = mirror.asDiagonal() * link.point_mm;
  }
  const Eigen::Matrix3d rotation =
      mirror.asDiagonal() * chain.home_pose.linear() * mirror.asDiagonal();
  result.home_pose.linear() = rotation;
  result.home_pose.translation() = mirror.asDiagonal() * chain.home_pose.translation();
  return result;
}

TEST(Chains, MirroredRigFlipsPhiD) {
  test::Random random(13);
  int compared = 0;
  for (int i = 0; i < 50; ++i) {
    const RigDescription rig = misaligned_la2(random);
    RigDescription mirror = rig;
    mirror.camera = mirrored(rig.camera);
    mirror.lamp = mirrored(rig.lamp);
    mirror.sample = mirrored(rig.sample);
    const Joints q =
        test::joints({random.uniform(10, 150), random.uniform(-40, 60), random.uniform(5, 40)});
    const auto pair = test::nominal(rig, q);
    if (pair.wi.z() <= 0.05 || pair.wo.z() <= 0.05) continue;
    const brdf::HalfDiff a = brdf::half_diff_from_directions(pair);
    const brdf::HalfDiff b = brdf::half_diff_from_directions(test::nominal(mirror, q));
    EXPECT_NEAR(a.theta_h.radians(), b.theta_h.radians(), kClosedForm);
    EXPECT_NEAR(a.theta_d.radians(), b.theta_d.radians(), kClosedForm);
    EXPECT_NEAR(a.phi_d.radians(), -b.phi_d.radians(), 1e-11);  // 1/sin theta_h
    ++compared;
  }
  EXPECT_GT(compared, 20);
}

TEST(Chains, OneAxisMayDriveTwoChains) {
  // Lamp and sample on one table: turning it moves neither against the other.
  RigDescription rig = test::unlimited_la2();
  rig.lamp.links = {rig.sample.links[0]};
  const auto wi_at = [&](double azimuth) {
    return test::nominal(rig, test::joints({0.0, azimuth, 20.0})).wi;
  };
  EXPECT_NEAR((wi_at(0.0) - wi_at(50.0)).norm(), 0.0, kClosedForm);
}

TEST(Chains, ForwardRefusesAWrongNumberOfJoints) {
  EXPECT_THROW(forward(la2(), test::joints({1.0, 2.0})), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::rig
