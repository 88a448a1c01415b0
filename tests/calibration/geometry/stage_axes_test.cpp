#include "gonio/calibration/geometry/stage_axes.h"

#include <gmock/gmock.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "gonio/calibration/result/step_refused.h"
#include "synthetic_rig.h"

namespace gonio::calibration::geometry {
namespace {

using test::gauge_from_hidden;
using test::hidden_rig;
using test::joints_deg;
using test::known_camera;
using test::Scale;
using test::stage_views;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::ThrowsMessage;

Eigen::Vector3d true_ray(const test::HiddenRig& hidden, const Eigen::Vector2d& pixel) {
  return gauge_from_hidden(hidden).linear() * hidden.rig.camera.home_pose.linear() *
         hidden.camera.ray(pixel.x(), pixel.y());
}

Eigen::Vector3d true_normal(const test::HiddenRig& hidden, const rig::Joints& joints) {
  return gauge_from_hidden(hidden).linear() * test::outward_normal(hidden, joints);
}

double true_axis_angle_deg(const test::HiddenRig& hidden) {
  return test::degrees_between(hidden.rig.sample.links[0].direction,
                               hidden.rig.sample.links[1].direction);
}

double true_skew_mm(const test::HiddenRig& hidden) {
  const auto& a = hidden.rig.sample.links[0];
  const auto& b = hidden.rig.sample.links[1];
  return (b.point_mm - a.point_mm).dot(a.direction.cross(b.direction).normalized());
}

std::vector<Eigen::Vector2d> four_pixels(const instrument::CameraModel& camera) {
  const double w = camera.width_px - 1.0;
  const double h = camera.height_px - 1.0;
  return {{0.1 * w, 0.1 * h}, {0.9 * w, 0.2 * h}, {0.5 * w, 0.5 * h}, {0.2 * w, 0.9 * h}};
}

class StageAxesOfScale : public ::testing::TestWithParam<Scale> {};

TEST_P(StageAxesOfScale, FindTheHiddenRig) {
  // Bars of the specification, 3.8; three times as much for angles at a quarter of the size.
  const double bar_deg = GetParam() == Scale::Full ? 0.01 : 0.03;
  for (const std::uint64_t seed : {1U, 2U}) {
    const auto hidden = hidden_rig(seed, GetParam());
    const auto views = stage_views(hidden, seed, 0.1, 0.002);
    StageAxesOptions options;
    options.u_joint = Angle::from_degrees(0.002);
    const StageAxes found =
        fit_stage_axes(rig::la2(), known_camera(hidden.camera, seed), views, options);
    EXPECT_NEAR(axis_angle(found).value.degrees(), true_axis_angle_deg(hidden), bar_deg);
    EXPECT_NEAR(axis_skew(found).value_mm, true_skew_mm(hidden), 0.01);
    for (const Eigen::Vector2d& pixel : four_pixels(hidden.camera)) {
      EXPECT_LT(test::degrees_between(pixel_ray(found, pixel).direction, true_ray(hidden, pixel)),
                bar_deg);
    }
    for (const auto& joints :
         {joints_deg(90, 0, 0), joints_deg(90, 40, 10), joints_deg(20, -60, 50)}) {
      EXPECT_LT(
          test::degrees_between(board_normal(found, joints).direction, true_normal(hidden, joints)),
          bar_deg);
    }
    const Eigen::Vector2d zeros =
        test::zeros_deg([&](const rig::Joints& j) { return board_normal(found, j).direction; });
    const Eigen::Vector2d true_zeros =
        test::zeros_deg([&](const rig::Joints& j) { return true_normal(hidden, j); });
    EXPECT_NEAR(zeros[0], true_zeros[0], bar_deg);
    EXPECT_NEAR(zeros[1], true_zeros[1], bar_deg);
    EXPECT_NEAR(found.camera.fx_px / hidden.camera.fx_px, 1.0, 0.001);
    EXPECT_NEAR(found.sigma_px, 0.1, 0.01);
    EXPECT_THAT(found.notes, IsEmpty());
  }
}
INSTANTIATE_TEST_SUITE_P(Scales, StageAxesOfScale, ::testing::Values(Scale::Full, Scale::Quarter));

TEST(StageAxes, OfABoardThatLeansAreThoseOfItsDatum) {
  const auto datum = hidden_rig(11, Scale::Full);
  const auto leaning = [&](double way) {
    test::HiddenRig hidden = datum;
    hidden.sample_from_board.linear() *= test::turn({way * 0.25, way * -0.3, 0.0});
    return fit_stage_axes(rig::la2(), known_camera(hidden.camera, 11),
                          stage_views(hidden, 11, 0.05), {});
  };
  const StageAxes one = leaning(1.0);
  const StageAxes found = on_its_datum(one, leaning(-1.0));
  // Where the board alone is believed, it is off by its lean, and further the more it is tilted.
  for (const double tilt : {0.0, 20.0, 40.0, 60.0}) {
    const auto joints = joints_deg(90.0, 20.0, tilt);
    const Eigen::Vector3d truth = true_normal(datum, joints);
    EXPECT_LT(test::degrees_between(board_normal(found, joints).direction, truth), 0.01) << tilt;
    EXPECT_GT(test::degrees_between(board_normal(one, joints).direction, truth), 0.2) << tilt;
  }
}

TEST(StageAxes, ReproduceExactObservationsThroughForwardKinematics) {
  const auto hidden = hidden_rig(3, Scale::Full);
  const auto views = stage_views(hidden, 3, 0.0);
  Intrinsics camera;
  camera.camera = hidden.camera;
  camera.covariance = CameraCovariance::Identity() * 1e-6;
  StageAxesOptions options;
  options.refine_camera = false;
  const StageAxes found = fit_stage_axes(rig::la2(), camera, views, options);
  for (const StageView& view : views) {
    const auto pose = rig::forward(found.rig, view.joints);
    const Eigen::Isometry3d camera_from_board = pose.world_from_camera.inverse() *
                                                pose.world_from_sample *
                                                found.board_from_sample.inverse();
    for (const BoardCorner& corner : view.board.corners) {
      const Eigen::Vector3d point(corner.point_mm.x(), corner.point_mm.y(), 0.0);
      EXPECT_LT((found.camera.project(camera_from_board * point) - corner.pixel).norm(), 1e-5);
    }
  }
}

TEST(StageAxes, ComeInTheirGauge) {
  const auto hidden = hidden_rig(4, Scale::Quarter);
  const StageAxes found =
      fit_stage_axes(rig::la2(), known_camera(hidden.camera, 4), stage_views(hidden, 4));
  constexpr double kRounding = 1e-12;
  EXPECT_NEAR(found.rig.camera.home_pose.translation().y(), 0.0, kRounding);
  EXPECT_GT(found.rig.camera.home_pose.translation().x(), 300.0);
  EXPECT_TRUE(found.rig.sample.links[0].direction.isApprox(Eigen::Vector3d::UnitZ(), kRounding));
  EXPECT_TRUE(found.rig.sample.home_pose.linear().col(2).isApprox(Eigen::Vector3d::UnitX(), 1e-9));
  EXPECT_NEAR(found.rig.sample.links[1].point_mm.z(), 0.0, kRounding);
  EXPECT_NEAR(found.rig.sample.links[1].point_mm.norm(), std::abs(true_skew_mm(hidden)), 0.01);
}

TEST(StageAxes, StateTheirUncertainty) {
  test::Coverage coverage;
  const auto component = [&](const DirectionEstimate& found, const Eigen::Vector3d& truth,
                             Eigen::Index k) {
    coverage.count(found.direction[k] - truth[k], std::sqrt(found.covariance(k, k)));
  };
  for (std::uint64_t seed = 100; seed < 124; ++seed) {
    const auto hidden = hidden_rig(seed, Scale::Quarter);
    StageAxesOptions options;
    options.u_joint = Angle::from_degrees(0.005);
    options.refine_camera = seed % 2 == 0;
    const StageAxes found = fit_stage_axes(rig::la2(), known_camera(hidden.camera, seed),
                                           stage_views(hidden, seed, 0.1, 0.005), options);
    const AngleEstimate angle = axis_angle(found);
    coverage.count(angle.value.degrees() - true_axis_angle_deg(hidden), angle.sigma.degrees());
    const LengthEstimate skew = axis_skew(found);
    coverage.count(skew.value_mm - true_skew_mm(hidden), skew.sigma_mm);
    const Eigen::Vector2d pixel = four_pixels(hidden.camera)[1];
    component(pixel_ray(found, pixel), true_ray(hidden, pixel), 1);
    component(pixel_ray(found, pixel), true_ray(hidden, pixel), 2);
    const auto joints = joints_deg(90, 0, 20);
    component(board_normal(found, joints), true_normal(hidden, joints), 1);
    component(board_normal(found, joints), true_normal(hidden, joints), 2);
  }
  RecordProperty("coverage", std::to_string(coverage.fraction()));
  EXPECT_GE(coverage.fraction(), 0.90);
  EXPECT_LE(coverage.fraction(), 0.99);
}

TEST(StageAxes, FindWhichWayAnAxisCounts) {
  for (const std::size_t link : {0U, 1U}) {
    const auto hidden = hidden_rig(5, Scale::Full);
    rig::RigDescription nominal = rig::la2();
    nominal.sample.links[link].scale = -1.0;
    const StageAxes found =
        fit_stage_axes(nominal, known_camera(hidden.camera, 5), stage_views(hidden, 5));
    EXPECT_GT(found.rig.sample.links[link].scale, 0.0);
    EXPECT_THAT(found.notes, ::testing::ElementsAre(HasSubstr("the other way round")));
    EXPECT_NEAR(axis_angle(found).value.degrees(), true_axis_angle_deg(hidden), 0.01);
  }
}

TEST(StageAxes, ResidualsOfTheJointsShowAnArrivalThatWasOff) {
  const auto hidden = hidden_rig(4, Scale::Full);
  auto views = stage_views(hidden, 4, 0.003, 0.0);
  constexpr std::size_t kOff = 12;
  views[kOff].joints[1] -= Angle::from_degrees(0.02);  // azimuth stands this much beyond it
  views[kOff].joints[2] += Angle::from_degrees(0.01);
  StageAxesOptions options;
  options.u_joint = Angle::from_degrees(0.002);
  options.outlier_factor = 1e9;
  const StageAxes found =
      fit_stage_axes(rig::la2(), known_camera(hidden.camera, 4), views, options);
  ASSERT_EQ(found.joint_residuals.size(), views.size());
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!found.views[v].used) {  // slanted too much
      EXPECT_TRUE(found.joint_residuals[v].array().isNaN().all());
      continue;
    }
    const Eigen::Vector2d residual_deg = found.joint_residuals[v] * 180.0 / 3.14159265358979323846;
    const Eigen::Vector2d expected =
        v == kOff ? Eigen::Vector2d(0.02, -0.01) : Eigen::Vector2d(0.0, 0.0);
    EXPECT_LT((residual_deg - expected).cwiseAbs().maxCoeff(), 0.004) << "view " << v;
  }
}

TEST(StageAxes, FindAnEccentricEncoder) {
  const auto hidden = hidden_rig(6, Scale::Full);
  random::Stream stream(random::make_key(6, "eccentric"));
  std::vector<StageView> views;
  for (int azimuth = -45; azimuth <= 45; azimuth += 9) {
    for (int tilt = 0; tilt <= 40; tilt += 10) {
      const rig::Joints readings = joints_deg(90.0, azimuth, tilt);
      rig::Joints joints = readings;
      joints[1] += Angle::from_degrees(0.05) * cos(readings[1]);
      const auto camera_from_board = rig::forward(hidden.rig, joints).world_from_camera.inverse() *
                                     test::world_from_board(hidden, joints);
      views.push_back({readings, test::seen_board(hidden.camera, camera_from_board, 0.03, stream)});
    }
  }
  StageAxesOptions options;
  options.u_eccentricity = Angle::from_degrees(0.1);
  const StageAxes found =
      fit_stage_axes(rig::la2(), known_camera(hidden.camera, 6), views, options);
  // Offset and cosine are told apart by the curvature over +-45 deg only.
  const double sigma_deg =
      std::sqrt(found.covariance(stage_parameter::kEccentricity, stage_parameter::kEccentricity)) *
      180.0 / 3.14159265358979323846;
  EXPECT_LT(sigma_deg, 0.01);
  EXPECT_NEAR(found.azimuth_eccentricity.a.degrees(), 0.05, 3.0 * sigma_deg);
  for (const double azimuth : {-45.0, 0.0, 45.0}) {
    const rig::Joints readings = joints_deg(90.0, azimuth, 10.0);
    rig::Joints joints = readings;
    joints[1] += Angle::from_degrees(0.05) * cos(readings[1]);
    EXPECT_LT(
        test::degrees_between(board_normal(found, readings).direction, true_normal(hidden, joints)),
        0.01);
  }
}

TEST(StageAxes, LeaveOutABadViewAndSlantedOnes) {
  const auto hidden = hidden_rig(7, Scale::Full);
  auto views = stage_views(hidden, 7);
  views[12].joints[2] += Angle::from_degrees(0.5);  // read while it moved
  const StageAxes found = fit_stage_axes(rig::la2(), known_camera(hidden.camera, 7), views);
  EXPECT_FALSE(found.views[12].used);
  EXPECT_THAT(found.views[12].why_not, HasSubstr("px rms"));
  EXPECT_THAT(found.views[4].why_not, HasSubstr("slanted"));  // azimuth -45, tilt 40
  EXPECT_NEAR(axis_angle(found).value.degrees(), true_axis_angle_deg(hidden), 0.01);
}

TEST(StageAxes, RefuseInOneLine) {
  const auto hidden = hidden_rig(8, Scale::Quarter);
  const Intrinsics camera = known_camera(hidden.camera, 8);
  const auto good = stage_views(hidden, 8);
  const auto refusal = [&](auto spoil, const char* why) {
    auto views = good;
    rig::RigDescription nominal = rig::la2();
    spoil(views, nominal);
    EXPECT_THAT([&] { fit_stage_axes(nominal, camera, views); },
                ThrowsMessage<StepRefused>(AllOf(HasSubstr(why), Not(HasSubstr("\n")))));
  };
  using Views = std::vector<StageView>;
  using Rig = rig::RigDescription;
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  refusal([](Views& v, Rig&) { v.resize(4); }, "usable views of 4, expected at least 12");
  refusal([](Views& v, Rig&) { v.clear(); }, "0 usable views");
  refusal([](Views& v, Rig&) { v[3].joints.pop_back(); }, "view 3 has 2 joint angles, expected 3");
  refusal([&](Views& v, Rig&) { v[3].joints[1] = Angle::from_degrees(kNaN); }, "azimuth at nan");
  refusal([&](Views& v, Rig&) { v[2].board.corners[1].pixel.x() = kNaN; }, "not a number");
  refusal([](Views& v, Rig&) { v[2].board.corners[1] = v[2].board.corners[2]; }, "given twice");
  refusal([](Views&, Rig& r) { r.sample.links.pop_back(); }, "is no LA-2");
  refusal(
      [](Views& v, Rig&) {
        for (StageView& view : v) view.joints[1] = 0.1 * view.joints[1];
      },
      "azimuth spans");
  refusal(
      [](Views& v, Rig&) {
        for (StageView& view : v) view.joints[1] = 1.5 * view.joints[1];
      },
      "azimuth turns by 0.67 deg per degree");
  refusal(
      [](Views&, Rig& r) {
        r.camera.home_pose.linear() = test::turn({0, 90, 0}) * r.camera.home_pose.linear();
      },
      "from where the rig file has it");
  const auto shift = [](StageView& view, double by_px) {
    for (BoardCorner& corner : view.board.corners) corner.pixel.y() += by_px;
  };
  refusal(
      [&](Views& v, Rig&) {  // the board is loose
        for (std::size_t k = 0; k < v.size(); k += 3) shift(v[k], 6.0);
      },
      "the board moved on its holder");
  refusal(
      [&](Views& v, Rig&) {  // the board slips half way through
        for (std::size_t k = v.size() / 2; k < v.size(); ++k) shift(v[k], 6.0);
      },
      "the board moved on its holder");
}

}  // namespace
}  // namespace gonio::calibration::geometry
