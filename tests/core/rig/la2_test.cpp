// The reference rig: its frames on hand-computed poses, and its closed form against the chains.
#include <gmock/gmock.h>

#include "rig_test_support.h"

namespace gonio::rig {
namespace {

using test::deg;
using test::joints;

// Rounding of unit vectors through some twenty operations.
constexpr double kRounding = 1e-12;

TEST(La2, SampleFacesTheCameraAtZero) {
  const RigPose pose = forward(la2(350.0, 500.0), joints({0.0, 0.0, 0.0}));
  EXPECT_TRUE(pose.world_from_camera.translation().isApprox(Eigen::Vector3d(350.0, 0.0, 0.0)));
  EXPECT_TRUE(pose.world_from_lamp.translation().isApprox(Eigen::Vector3d(500.0, 0.0, 0.0)));
  EXPECT_TRUE(pose.world_from_sample.linear().col(2).isApprox(Eigen::Vector3d::UnitX()));
  EXPECT_TRUE(pose.world_from_camera.linear().col(2).isApprox(-Eigen::Vector3d::UnitX()));
}

TEST(La2, ArmCarriesTheLampCounterClockwiseAndLooksInwards) {
  const RigPose pose = forward(la2(350.0, 500.0), joints({90.0, 0.0, 0.0}));
  EXPECT_NEAR((pose.world_from_lamp.translation() - Eigen::Vector3d(0.0, 500.0, 0.0)).norm(), 0.0,
              500.0 * kRounding);
  EXPECT_NEAR((pose.world_from_lamp.linear().col(2) + Eigen::Vector3d::UnitY()).norm(), 0.0,
              kRounding);
}

TEST(La2, AzimuthTurnsTheNormalLeftAndTiltRaisesIt) {
  const RigPose pose = forward(la2(), joints({90.0, 30.0, 20.0}));
  const Eigen::Vector3d normal = pose.world_from_sample.linear().col(2);
  const double cos20 = 0.9396926207859084;
  const double sin20 = 0.3420201433256687;
  const Eigen::Vector3d expected(cos20 * 0.8660254037844386, cos20 * 0.5, sin20);
  EXPECT_NEAR((normal - expected).norm(), 0.0, kRounding);
}

TEST(La2, MirrorPoseShowsTheMirrorDirection) {
  // Lamp at 60 deg, normal half-way: theta_h = 0, theta_d = 30.
  const auto pair = test::nominal(la2(), joints({60.0, 30.0, 0.0}));
  const brdf::HalfDiff d = brdf::half_diff_from_directions(pair);
  EXPECT_NEAR(d.theta_h.degrees(), 0.0, 1e-10);
  EXPECT_NEAR(d.theta_d.degrees(), 30.0, 1e-10);
}

TEST(La2, DirectionsAtAPointSeeTheFiniteDistances) {
  // Sample faces the camera, lamp at 90 deg grazes; a point 10 mm along x_S = +y of the world.
  const auto pair = forward(la2(350.0, 500.0), joints({90.0, 0.0, 0.0}))
                        .directions_at(Eigen::Vector3d(10.0, 0.0, 0.0));
  EXPECT_NEAR((pair.wi - Eigen::Vector3d::UnitX()).norm(), 0.0, kRounding);
  const Eigen::Vector3d to_camera = Eigen::Vector3d(-10.0, 0.0, 350.0).normalized();
  EXPECT_NEAR((pair.wo - to_camera).norm(), 0.0, kRounding);
}

TEST(La2, CollimatedLampShinesFromOneDirectionOnAllPoints) {
  RigDescription rig = la2();
  rig.collimated_lamp = true;
  const RigPose pose = forward(rig, joints({60.0, 30.0, 10.0}));
  const auto centre = pose.directions_at(Eigen::Vector3d::Zero());
  const auto rim = pose.directions_at(Eigen::Vector3d(25.0, 10.0, 0.0));
  EXPECT_NEAR((centre.wi - rim.wi).norm(), 0.0, kRounding);
  EXPECT_GT((centre.wo - rim.wo).norm(), 0.05);
}

TEST(La2, EveryBranchShowsTheDirectionItWasSolvedFor) {
  const Inverse inverse(test::unlimited_la2(), {true, true, true});
  ASSERT_TRUE(inverse.closed_form());
  test::Random random(20);
  double worst = 0.0;
  std::size_t poses = 0;
  for (int i = 0; i < 20000; ++i) {
    const brdf::HalfDiff d = test::random_direction(random, 89.0);
    const Reach reach = inverse.solve(d);
    ASSERT_FALSE(reach.refusal) << reach.refusal->detail;
    for (const PoseSolution& pose : reach.poses) {
      const auto shown = test::nominal(inverse.rig(), pose.joints);
      worst = std::max(worst, test::difference(shown, test::wanted(d, pose)));
      // And once more through the coordinates.
      const auto again = brdf::directions_from_half_diff(brdf::half_diff_from_directions(shown));
      worst = std::max(worst, test::difference(again, shown));
    }
    poses += reach.poses.size();
  }
  EXPECT_EQ(poses, 8u * 20000u);
  EXPECT_LT(worst, kRounding);
}

TEST(La2, BranchesAreNamed) {
  const Reach reach =
      Inverse(test::unlimited_la2(), {true, true, true}).solve(half_diff_deg(20, 30, 40));
  std::vector<std::string> names;
  for (const PoseSolution& pose : reach.poses) names.push_back(branch_name(pose));
  EXPECT_THAT(names, testing::ElementsAre("A", "B", "C", "D", "A'", "B'", "C'", "D'"));
}

TEST(La2, ABranchIsKnownByTheSideOfItsJoints) {
  // Also on a misaligned LA-2, whose joints are found numerically.
  RigDescription misaligned = test::unlimited_la2();
  misaligned.sample.links[1].direction =
      Eigen::Vector3d(0.01, -1.0, 0.005).normalized();  // more than any mounting
  for (const RigDescription& rig : {test::unlimited_la2(), misaligned}) {
    const Inverse inverse(rig, {true, true, true});
    test::Random random(23);
    for (int i = 0; i < 50; ++i) {
      // Away from the axis, where the two sides meet.
      brdf::HalfDiff d = test::random_direction(random, 75.0);
      d.theta_d = std::max(d.theta_d, deg(5.0));
      for (PoseSolution pose : inverse.solve(d).poses) {
        EXPECT_TRUE(inverse.on_named_side(d, pose)) << branch_name(pose);
        pose.joints[0] = pose.joints[0] + deg(0.01);  // people round
        EXPECT_TRUE(inverse.on_named_side(d, pose)) << branch_name(pose);
        constexpr std::array kOther{Branch::B, Branch::A, Branch::D, Branch::C};
        pose.branch = kOther[static_cast<std::size_t>(pose.branch)];
        EXPECT_FALSE(inverse.on_named_side(d, pose)) << branch_name(pose);
      }
    }
  }
}

TEST(La2, BranchAKeepsTheLampOnItsSideAndTheTiltUp) {
  // phi_d in [0, 180): branch A alone covers the MERL domain with alpha, gamma >= 0, |beta| < 90.
  const Inverse inverse(test::unlimited_la2(), {false, false, false});
  test::Random random(21);
  for (int i = 0; i < 2000; ++i) {
    brdf::HalfDiff d = test::random_direction(random, 89.0);
    d.phi_d = abs(d.phi_d);
    const Joints q = inverse.solve(d).poses.at(0).joints;
    EXPECT_GE(q[0], Angle());
    EXPECT_LE(abs(q[1]), deg(90.0));
    EXPECT_GE(q[2].degrees(), -1e-9);
  }
}

TEST(La2, IsRecognisedWithOtherAxisOrderSignsOffsetsAndASpin) {
  RigDescription rig = la2();
  std::swap(rig.axes[0], rig.axes[2]);
  rig.lamp.links[0].axis = 2;
  rig.lamp.links[0].direction *= -1.0;  // the arm counts clockwise
  rig.lamp.links[0].scale = -1.0;       // ... in a controller that counts backwards
  rig.sample.links[1].axis = 0;
  rig.sample.links[0].offset = deg(5.0);
  Axis spin;
  spin.name = "spin";
  spin.min = deg(-180.0);
  spin.max = deg(180.0);
  spin.home = deg(12.0);
  rig.axes.push_back(spin);
  ChainLink link = rig.sample.links[0];
  link.axis = 3;
  link.direction = Eigen::Vector3d::UnitX();
  link.offset = Angle();
  rig.sample.links.push_back(link);

  const Inverse inverse(rig);
  EXPECT_TRUE(inverse.closed_form());
  for (const brdf::HalfDiff& d : test::kPublishedTen) {
    const Reach reach = inverse.solve(d);
    ASSERT_FALSE(reach.poses.empty()) << reach.refusal->detail;
    for (const PoseSolution& pose : reach.poses) {
      EXPECT_LT(test::difference(test::nominal(rig, pose.joints), test::wanted(d, pose)),
                kRounding);
      EXPECT_EQ(pose.joints[3], deg(12.0));
    }
  }
}

TEST(La2, IsNotClaimedForARigThatIsBent) {
  RigDescription rig = la2();
  rig.sample.links[1].direction = Eigen::Vector3d(1e-6, -1.0, 0.0).normalized();
  EXPECT_FALSE(Inverse(rig).closed_form());
  rig = la2();
  rig.lamp.links[0].point_mm = Eigen::Vector3d(0.0, 1e-3, 0.0);
  EXPECT_FALSE(Inverse(rig).closed_form());
  rig = la2();
  rig.sample.home_pose.translation().x() = 0.1;
  EXPECT_FALSE(Inverse(rig).closed_form());
}

}  // namespace
}  // namespace gonio::rig
