#include "gonio/calibration/geometry/lamp_arm.h"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "gonio/calibration/result/step_refused.h"
#include "mirror_views.h"

namespace gonio::calibration::geometry {
namespace {

using test::found_stage;
using test::hidden_mirror;
using test::hidden_rig;
using test::HiddenMirror;
using test::HiddenRig;
using test::joints_deg;
using test::mirror_views;
using test::Scale;
using test::usual_mount;
using test::with_jitter;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::ThrowsMessage;

Eigen::Vector3d true_lamp(const HiddenRig& hidden, double arm_deg) {
  return test::gauge_from_hidden(hidden) *
         rig::forward(hidden.rig, joints_deg(arm_deg, 0.0, 0.0)).world_from_lamp.translation();
}

class LampArmOfScale : public ::testing::TestWithParam<Scale> {};

TEST_P(LampArmOfScale, FindsTheLampOverTheWholeArc) {
  // Bars of the specification, 3.8; three times as much for angles at a quarter of the size.
  const double bar_deg = GetParam() == Scale::Full ? 0.02 : 0.06;
  for (const std::uint64_t seed : {1U, 2U}) {
    const auto hidden = hidden_rig(seed, GetParam());
    const auto views = mirror_views(hidden, hidden_mirror(seed, usual_mount()), seed, true);
    ASSERT_GT(views.size(), 80U);
    const LampArm found =
        fit_lamp_arm(found_stage(hidden, seed), views, usual_mount(), with_jitter());
    for (double arm = 10.0; arm <= 170.0; arm += 10.0) {
      const Eigen::Vector3d truth = true_lamp(hidden, arm);
      const auto wi = lamp_direction(found, Angle::from_degrees(arm));
      EXPECT_LT(test::degrees_between(wi.direction, truth), bar_deg) << arm;
      const auto distance = lamp_distance(found, Angle::from_degrees(arm));
      EXPECT_NEAR(distance.value_mm / truth.norm(), 1.0, 0.003);
      // The rig says the same.
      EXPECT_NEAR(
          (rig::forward(found.rig, joints_deg(arm, 0.0, 0.0)).world_from_lamp.translation() -
           distance.value_mm * wi.direction)
              .norm(),
          0.0, 1e-9);
    }
    EXPECT_LT(found.rms_px, 0.2);
    EXPECT_NEAR(found.rig.lamp.home_pose.translation().y(), 0.0, 1e-12);
  }
}
INSTANTIATE_TEST_SUITE_P(Scales, LampArmOfScale, ::testing::Values(Scale::Full, Scale::Quarter));

TEST(LampArm, StatesItsUncertainty) {
  test::Coverage coverage;
  for (std::uint64_t seed = 200; seed < 224; ++seed) {
    const auto hidden = hidden_rig(seed, Scale::Quarter);
    const StageAxes stage = found_stage(hidden, seed);
    for (const bool both_ways : {true, false}) {
      const auto views = mirror_views(hidden, hidden_mirror(seed, usual_mount()), seed, both_ways);
      const LampArm found = fit_lamp_arm(stage, views, usual_mount(), with_jitter());
      for (const double arm : {15.0, 90.0, 165.0}) {
        const auto wi = lamp_direction(found, Angle::from_degrees(arm));
        const Eigen::Vector3d truth = true_lamp(hidden, arm).normalized();
        const Eigen::Vector3d along = Eigen::Vector3d::UnitZ().cross(truth).normalized();
        for (const Eigen::Vector3d& axis : {along, Eigen::Vector3d(truth.cross(along))}) {
          coverage.count((wi.direction - truth).dot(axis),
                         std::sqrt(axis.dot(wi.covariance * axis)));
        }
      }
    }
  }
  RecordProperty("coverage", std::to_string(coverage.fraction()));
  EXPECT_GE(coverage.fraction(), 0.90);
  EXPECT_LE(coverage.fraction(), 0.99);
}

TEST(LampArm, KnowsThatTurningTheMirrorShowsItsTilt) {
  const auto hidden = hidden_rig(3, Scale::Full);
  const HiddenMirror mirror = hidden_mirror(3, usual_mount());
  const StageAxes stage = found_stage(hidden, 3);
  const auto sigma_deg = [&](bool both_ways) {
    const LampArm found = fit_lamp_arm(stage, mirror_views(hidden, mirror, 3, both_ways),
                                       usual_mount(), with_jitter());
    return lamp_direction(found, Angle::from_degrees(90.0)).sigma().degrees();
  };
  EXPECT_LT(sigma_deg(true), 0.005);
  EXPECT_GT(sigma_deg(false), 2.0 * sigma_deg(true));
}

TEST(LampArm, FindsWhichWayTheArmCounts) {
  const auto hidden = hidden_rig(4, Scale::Full);
  rig::RigDescription nominal = rig::la2();
  nominal.lamp.links[0].scale = -1.0;
  const LampArm found = fit_lamp_arm(found_stage(hidden, 4, nominal),
                                     mirror_views(hidden, hidden_mirror(4, usual_mount()), 4, true),
                                     usual_mount(), with_jitter());
  EXPECT_THAT(found.notes, ElementsAre(HasSubstr("lamp_arm counts the other way round")));
  EXPECT_LT(test::degrees_between(lamp_direction(found, Angle::from_degrees(60.0)).direction,
                                  true_lamp(hidden, 60.0)),
            0.02);
}

TEST(LampArm, HardlyMindsAFalseHighlight) {
  const auto hidden = hidden_rig(5, Scale::Full);
  auto views = mirror_views(hidden, hidden_mirror(5, usual_mount()), 5, true);
  views[20].pixel.x() = 0.5 * hidden.camera.width_px;
  views[20].pixel.y() = 10.0;
  const LampArm found = fit_lamp_arm(found_stage(hidden, 5), views, usual_mount(), [] {
    LampArmOptions options = with_jitter();
    options.max_rms_px = 200.0;
    return options;
  }());
  EXPECT_LT(test::degrees_between(lamp_direction(found, Angle::from_degrees(60.0)).direction,
                                  true_lamp(hidden, 60.0)),
            0.02);
  EXPECT_GT(found.residual_px[20].norm(), 50.0);
}

TEST(LampArm, RefusesInOneLine) {
  const auto hidden = hidden_rig(6, Scale::Quarter);
  const StageAxes good_stage = found_stage(hidden, 6);
  const auto good = mirror_views(hidden, hidden_mirror(6, usual_mount()), 6, true);
  const auto refusal = [&](auto spoil, const char* why) {
    auto views = good;
    StageAxes stage = good_stage;
    spoil(views, stage);
    EXPECT_THAT([&] { fit_lamp_arm(stage, views, usual_mount(), with_jitter()); },
                ThrowsMessage<StepRefused>(AllOf(HasSubstr(why), Not(HasSubstr("\n")))));
  };
  using Views = std::vector<MirrorView>;
  refusal([](Views& v, StageAxes&) { v.resize(7); }, "7 mirror views, expected at least 20");
  refusal([](Views& v, StageAxes&) { v.clear(); }, "0 mirror views");
  refusal([](Views& v, StageAxes&) { v[2].joints.clear(); }, "view 2 has 0 joint angles");
  refusal([](Views& v, StageAxes&) { v[2].pixel.x() = std::numeric_limits<double>::quiet_NaN(); },
          "expected it in the image");
  refusal(
      [](Views& v, StageAxes&) {
        for (MirrorView& view : v) view.joints[0] = 0.2 * view.joints[0];
      },
      "the arm spans");
  refusal(
      [](Views& v, StageAxes&) {
        for (MirrorView& view : v) view.joints[0] = 2.0 * view.joints[0];
      },
      "does not follow the arm's reading");
  refusal(
      [](Views& v, StageAxes&) {
        for (std::size_t k = 0; k < v.size(); k += 2) v[k].pixel.y() += 4.0;  // the mirror slips
      },
      "mirror or lamp moved");
  refusal([](Views& v, StageAxes&) { v[9].joints[1] += Angle::from_degrees(150.0); }, "away");
  refusal([](Views&, StageAxes& s) { s.rig.lamp.links.clear(); }, "no lamp on one arm");
}

}  // namespace
}  // namespace gonio::calibration::geometry
