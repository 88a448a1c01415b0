// Every figure is there, with as many marks as there is data, where the axes' numbers say.

#include <gmock/gmock.h>

#include <limits>
#include <numbers>

#include "gonio/calibration/sensor/darks.h"
#include "gonio/calibration_report/calibration_report.h"
#include "page_reading.h"

namespace gonio::calibration_report {
namespace {

using test::Figure;
using test::has_mark;
using test::Mark;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
namespace geometry = calibration::geometry;
namespace routine = calibration::routine;

constexpr double kRadPerMilliDegree = std::numbers::pi / 180'000.0;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Angle deg(double value) { return Angle::from_degrees(value); }

instrument::CameraModel camera() {
  return {.width_px = 600,
          .height_px = 500,
          .fx_px = 1400.0,
          .fy_px = 1400.0,
          .cx_px = 299.5,
          .cy_px = 249.5};
}

/// A board 400 mm away, each corner seen off its place by `off`(index) px.
template <typename Off>
geometry::StageView seen_board(int corners, const Off& off) {
  geometry::StageView view;
  for (int i = 0; i < corners; ++i) {
    const Eigen::Vector2d point(10.0 * (i % 8) - 35.0, 10.0 * (i / 8 % 6) - 25.0);
    const Eigen::Vector2d pixel = camera().project({point.x(), point.y(), 400.0}) + off(i);
    view.board.corners.push_back({i, pixel, point});
  }
  return view;
}

geometry::FittedView fitted(bool used) {
  geometry::FittedView view;
  view.used = used;
  view.camera_from_board.translation().z() = 400.0;
  view.rms_px = used ? 0.1 : 0.9;
  return view;
}

CalibrationReportData with_intrinsics(const std::vector<geometry::StageView>& views,
                                      const std::vector<bool>& used) {
  CalibrationReportData data;
  data.instrument.camera = camera();
  data.findings.intrinsics.emplace();
  data.findings.intrinsics->camera = camera();
  data.findings.intrinsics->rms_px = 0.1;
  for (const bool each : used) data.findings.intrinsics->views.push_back(fitted(each));
  data.observations["intrinsics"].boards = views;
  return data;
}

TEST(ReportFigures, PhotonTransferAndItsResiduals) {
  CalibrationReportData data;
  calibration::sensor::PhotonTransfer ptc;
  ptc.points = {{0.1, 100.0, 42.0, 40.0, true},
                {0.2, 200.0, 79.2, 80.0, true},
                {0.3, 300.0, 60.0, 120.0, false}};
  data.findings.photon_transfer = ptc;
  calibration::sensor::LevelStatistics level;
  level.variance_dn2 = {80.0, 1.2};
  data.observations["photon_transfer"].levels = {level};
  const std::string page = html(data);
  const Figure curve(page, "Photon transfer");
  EXPECT_THAT(curve.circles("dot g"), SizeIs(2));
  EXPECT_TRUE(has_mark(curve.circles("dot g"), 100.0, 42.0, 0.5, 0.2));
  ASSERT_THAT(curve.circles("off b"), SizeIs(1));
  EXPECT_TRUE(has_mark(curve.circles("off b"), 300.0, 60.0, 0.5, 0.2));
  ASSERT_THAT(curve.curves("curve r"), SizeIs(1));
  EXPECT_NEAR(curve.curves("curve r")[0].second.y, 80.0, 0.2);
  const Figure residuals(page, "Photon transfer: residuals");
  EXPECT_THAT(residuals.circles("dot g"), SizeIs(2));
  EXPECT_TRUE(has_mark(residuals.circles("dot g"), 100.0, 5.0, 0.5, 0.02));
  EXPECT_TRUE(has_mark(residuals.circles("dot g"), 200.0, -1.0, 0.5, 0.02));
  EXPECT_THAT(residuals.text(), HasSubstr("two sigmas"));
}

TEST(ReportFigures, LinearityBeforeAndAfterTheCurve) {
  CalibrationReportData data;
  data.findings.linearity.emplace();
  data.findings.linearity->points = {{0.1, 500.0, 0.8, 0.01, true},
                                     {0.2, 1000.0, -0.4, -0.02, true},
                                     {0.3, 4000.0, -9.0, -9.0, false}};
  const Figure linearity(html(data), "Linearity");
  ASSERT_THAT(linearity.circles("off r"), SizeIs(2));
  EXPECT_TRUE(has_mark(linearity.circles("off r"), 1000.0, -0.4, 3.0, 0.005));
  EXPECT_TRUE(has_mark(linearity.circles("dot g"), 500.0, 0.01, 3.0, 0.005));
}

TEST(ReportFigures, BadPixelsAtTheirPlaces) {
  namespace defect = calibration::sensor::defect;
  CalibrationReportData data;
  data.instrument.camera.width_px = 40;
  data.instrument.camera.height_px = 30;
  data.findings.bad_pixels.assign(40 * 30, 0);
  data.findings.bad_pixels[7 * 40 + 5] = defect::kHot | defect::kBlinking;
  data.findings.bad_pixels[20 * 40 + 31] = defect::kCold;
  data.findings.bad_pixels[29 * 40 + 39] = defect::kBlinking;
  const Figure map(html(data), "Bad pixels in the frame");
  ASSERT_THAT(map.circles("dot r"), SizeIs(1));
  EXPECT_TRUE(has_mark(map.circles("dot r"), 5.0, 7.0, 0.05, 0.05));
  ASSERT_THAT(map.circles("dot b"), SizeIs(1));
  EXPECT_TRUE(has_mark(map.circles("dot b"), 31.0, 20.0, 0.05, 0.05));
  ASSERT_THAT(map.circles("dot light"), SizeIs(1));
  EXPECT_TRUE(has_mark(map.circles("dot light"), 39.0, 29.0, 0.05, 0.05));
}

TEST(ReportFigures, VeryManyBadPixelsBecomeADensity) {
  CalibrationReportData data;
  data.instrument.camera.width_px = 640;
  data.instrument.camera.height_px = 640;
  data.findings.bad_pixels.assign(640 * 640, 0);
  // Fields of 20 px: the third of the second row is full, the last has half of its rows.
  for (std::size_t row = 0; row < 640; ++row) {
    for (std::size_t column = 0; column < 640; ++column) {
      const bool full = row / 20 == 1 && column / 20 == 2;
      const bool half = row / 20 == 31 && column / 20 == 31 && row % 2 == 0;
      const bool spread = row % 12 == 0 && column % 10 == 0;
      data.findings.bad_pixels[row * 640 + column] = full || half || spread ? 1 : 0;
    }
  }
  const std::string page = html(data);
  const Figure map(page, "Bad pixels in the frame");
  EXPECT_THAT(map.text(), Not(HasSubstr("<circle")));
  EXPECT_THAT(map.dots(), IsEmpty());
  int checked = 0;
  for (const test::Field& field : map.fields("much")) {
    if (std::abs(field.x - 49.5) < 2.0 && std::abs(field.y - 29.5) < 2.0) {
      EXPECT_NEAR(field.strength, 400.0 / 500.0, 1e-3);
      ++checked;
    }
    if (std::abs(field.x - 629.5) < 2.0 && std::abs(field.y - 629.5) < 2.0) {
      EXPECT_NEAR(field.strength, 200.0 / 500.0, 0.02);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 2);
  EXPECT_LT(page.size(), 500'000U);
}

TEST(ReportFigures, CornersAboutTheirModel) {
  const auto small = seen_board(40, [](int i) { return Eigen::Vector2d(0.01 * i, -0.005 * i); });
  const auto wild = seen_board(40, [](int) { return Eigen::Vector2d(3.0, 3.0); });
  const std::string page = html(with_intrinsics({small, wild}, {true, false}));
  const Figure cloud(page, "Reprojection: intrinsics");
  ASSERT_THAT(cloud.circles("dot g"), SizeIs(40));
  EXPECT_TRUE(has_mark(cloud.circles("dot g"), 0.39, -0.195, 0.002, 0.002));
  EXPECT_NEAR(cloud.circle_radius("curve r"), 0.1, 0.002);
  EXPECT_THAT(cloud.text(), HasSubstr("All 40 corners."));
  const Figure views(page, "Misfit by view: intrinsics");
  EXPECT_TRUE(has_mark(views.circles("dot g"), 1.0, 0.1, 0.01, 0.005));
  EXPECT_TRUE(has_mark(views.circles("off beyond"), 2.0, 0.9, 0.01, 0.005));
}

TEST(ReportFigures, NeedlesPointWhereThePictureIsOff) {
  // All corners to the right, those on the left by half as much.
  std::vector<geometry::StageView> views(
      8, seen_board(48, [](int i) { return Eigen::Vector2d(i % 8 < 4 ? 0.05 : 0.1, 0.0); }));
  const Figure map(html(with_intrinsics(views, std::vector<bool>(8, true))),
                   "Reprojection over the picture: intrinsics");
  const auto feet = map.circles("dot b");
  const auto needles = map.curves("curve b");
  ASSERT_FALSE(feet.empty());
  ASSERT_EQ(needles.size(), feet.size());
  for (std::size_t i = 0; i < feet.size(); ++i) {
    // Fields of 50 px; the longest needle is nine tenths of one.
    EXPECT_NEAR(std::fmod(feet[i].x, 50.0), 25.0, 0.5);
    EXPECT_NEAR(needles[i].second.x - needles[i].first.x, feet[i].x < 300.0 ? 22.5 : 45.0, 0.5);
    EXPECT_NEAR(needles[i].second.y, needles[i].first.y, 0.5);
  }
  EXPECT_THAT(map.text(), HasSubstr("the longest is 0.1 px"));
}

TEST(ReportFigures, ThousandsOfCornersAreThinnedButTheFarOnesStay) {
  std::vector<geometry::StageView> views;
  for (int v = 0; v < 200; ++v) {
    views.push_back(seen_board(100, [&](int i) {
      return v == 150 && i == 33 ? Eigen::Vector2d(0.0, 1.5)
                                 : Eigen::Vector2d(0.0004 * i, 0.0003 * v);
    }));
  }
  const CalibrationReportData data = with_intrinsics(views, std::vector<bool>(views.size(), true));
  const std::string page = html(data);
  EXPECT_EQ(page, html(data));
  EXPECT_LT(page.size(), 300'000U);
  const Figure cloud(page, "Reprojection: intrinsics");
  EXPECT_THAT(cloud.dots(), SizeIs(2859));  // every 7th of 20,000 and the one that is far off
  EXPECT_TRUE(has_mark(cloud.dots(), 0.0, 1.5, 0.01, 0.01));
  EXPECT_TRUE(has_mark(cloud.dots(), 0.0004 * 7, 0.0, 0.01, 0.01));
  EXPECT_THAT(cloud.text(), HasSubstr("2859 of 20000 corners"));
}

TEST(ReportFigures, AxisFitOverTheAnglesOfTheAxis) {
  CalibrationReportData data;
  data.findings.stage.emplace();
  auto& stage = *data.findings.stage;
  stage.rig = rig::la2(350.0, 500.0);
  const std::size_t azimuth = stage.rig.sample.links[0].axis;
  const std::size_t tilt = stage.rig.sample.links[1].axis;
  auto& boards = data.observations["stage_axes"].boards;
  for (int i = 0; i < 5; ++i) {
    geometry::StageView view;
    view.joints.assign(stage.rig.axes.size(), Angle());
    view.joints[azimuth] = deg(-40.0 + 20.0 * i);
    view.joints[tilt] = deg(5.0 * i);
    boards.push_back(view);
    stage.views.push_back(fitted(true));
    stage.joint_residuals.emplace_back(kRadPerMilliDegree * Eigen::Vector2d(2.0 * i, -1.0 * i));
  }
  stage.joint_residuals[1] = {kNaN, kNaN};
  const std::string page = html(data);
  const Figure about(page, "Axis fit: " + stage.rig.axes[azimuth].name);
  ASSERT_THAT(about.circles("dot g"), SizeIs(4));
  EXPECT_TRUE(has_mark(about.circles("dot g"), 40.0, 8.0, 0.2, 0.05));
  const Figure tilted(page, "Axis fit: " + stage.rig.axes[tilt].name);
  ASSERT_THAT(tilted.circles("dot g"), SizeIs(4));
  EXPECT_TRUE(has_mark(tilted.circles("dot g"), 15.0, -3.0, 0.1, 0.05));
}

TEST(ReportFigures, ArrivalsHomingsAndSettling) {
  CalibrationReportData data;
  data.observations["backlash"].axes.push_back({"tilt",
                                                {deg(1.001), deg(0.999)},
                                                {{deg(10.0), true, deg(10.001), deg(10.002)},
                                                 {deg(10.0), false, deg(10.001), deg(10.05)},
                                                 {deg(20.0), true, deg(20.0), deg(20.0)}},
                                                {{0.0, deg(5.01)}, {1.0, deg(5.0)}}});
  const std::string page = html(data);
  const Figure arrivals(page, "tilt: arrivals");
  ASSERT_THAT(arrivals.circles("dot g"), SizeIs(2));
  EXPECT_TRUE(has_mark(arrivals.circles("dot g"), 10.0, 2.0, 0.1, 0.3));
  EXPECT_TRUE(has_mark(arrivals.circles("dot b"), 10.0, 50.0, 0.1, 0.3));
  const Figure homings(page, "tilt: one place after each homing");
  EXPECT_TRUE(has_mark(homings.circles("dot g"), 1.0, 1.0, 0.01, 0.02));
  EXPECT_TRUE(has_mark(homings.circles("dot g"), 2.0, -1.0, 0.01, 0.02));
  const Figure settling(page, "tilt: settling after a long move");
  ASSERT_THAT(settling.curves("curve b"), SizeIs(1));
  EXPECT_NEAR(settling.curves("curve b")[0].first.y, 10.0, 0.1);
}

TEST(ReportFigures, LampInTheMirrorOverThePictureAndTheArm) {
  CalibrationReportData data;
  data.findings.lamp_arm.emplace();
  auto& arm = *data.findings.lamp_arm;
  arm.rig = rig::la2(350.0, 500.0);
  arm.rms_px = 0.05;
  arm.residual_px = {{0.03, -0.04}, {-0.05, 0.01}};
  const std::size_t axis = arm.rig.lamp.links[0].axis;
  for (const bool turned : {false, true}) {
    geometry::MirrorView view;
    view.joints.assign(arm.rig.axes.size(), Angle());
    view.joints[axis] = deg(turned ? 120.0 : 30.0);
    view.turned = turned;
    data.observations["lamp_arm"].mirrors.push_back(view);
  }
  const std::string page = html(data);
  const Figure cloud(page, "Lamp in the mirror");
  ASSERT_THAT(cloud.circles("dot g"), SizeIs(1));
  EXPECT_TRUE(has_mark(cloud.circles("dot g"), 0.03, -0.04, 5e-4, 5e-4));
  EXPECT_TRUE(has_mark(cloud.circles("dot b"), -0.05, 0.01, 5e-4, 5e-4));
  EXPECT_NEAR(cloud.circle_radius("curve r"), 0.05, 5e-4);
  const Figure fit(page, "Axis fit: lamp arm");
  EXPECT_TRUE(has_mark(fit.circles("dot g"), 120.0, -0.05, 0.5, 5e-4));
  EXPECT_TRUE(has_mark(fit.circles("off b"), 30.0, -0.04, 0.5, 5e-4));
}

TEST(ReportFigures, MirrorPeaksAndTheirScans) {
  CalibrationReportData data;
  data.findings.zeros.emplace();
  data.findings.zeros->covariance.setIdentity();
  data.findings.zeros->residuals = {kRadPerMilliDegree * Eigen::Vector2d(3.0, 1.0),
                                    kRadPerMilliDegree * Eigen::Vector2d(-2.0, -4.0)};
  data.findings.lamp_arm.emplace();
  data.findings.lamp_arm->rig = rig::la2(350.0, 500.0);
  const auto& rig = data.findings.lamp_arm->rig;
  for (const bool turned : {false, true}) {
    geometry::Peak peak;
    peak.joints.assign(rig.axes.size(), Angle());
    peak.joints[rig.sample.links[0].axis] = deg(30.0);
    peak.turned = turned;
    data.findings.peaks.push_back(peak);
    routine::PeakScan scan{turned, {}};
    for (const double azimuth : {29.0, 30.0, 31.0}) {
      rig::Joints joints = peak.joints;
      joints[rig.sample.links[0].axis] = deg(azimuth);
      joints[rig.lamp.links[0].axis] = deg(60.0);
      scan.samples.push_back({joints, azimuth == 30.0 ? 80.0 : 20.0, 1.0});
    }
    data.observations["zero_offsets"].scans.push_back(scan);
  }
  const std::string page = html(data);
  const Figure peaks(page, "Mirror peaks: what is left");
  ASSERT_THAT(peaks.circles("dot g"), SizeIs(1));
  EXPECT_TRUE(has_mark(peaks.circles("dot g"), 3.0, 1.0, 0.05, 0.05));
  EXPECT_TRUE(has_mark(peaks.circles("dot b"), -2.0, -4.0, 0.05, 0.05));
  EXPECT_NEAR(peaks.circle_radius("curve r"), std::sqrt(15.0), 0.05);
  const Figure scans(page, "Mirror peaks: the scans");
  EXPECT_THAT(scans.circles("dot b"), SizeIs(3));
  EXPECT_TRUE(has_mark(scans.circles("dot g"), -1.0, 0.25, 0.01, 0.005));
  EXPECT_THAT(scans.text(), HasSubstr("arm at 60 deg, turned"));
}

TEST(ReportFigures, WarmUpWithItsFit) {
  CalibrationReportData data;
  data.findings.lamp.emplace();
  data.findings.lamp->level.value = 200.0;
  data.findings.lamp->amplitude.value = 0.1;
  data.findings.lamp->tau_s.value = 600.0;
  data.observations["warm_up"].lamp = {{0.0, 182.0}, {600.0, 193.0}, {1200.0, 201.0}};
  const Figure figure(html(data), "Warm-up and drift");
  ASSERT_THAT(figure.circles("dot g"), SizeIs(3));
  EXPECT_TRUE(has_mark(figure.circles("dot g"), 0.0, -9.0, 0.05, 0.03));
  EXPECT_TRUE(has_mark(figure.circles("dot g"), 20.0, 0.5, 0.05, 0.03));
  ASSERT_THAT(figure.curves("curve r"), SizeIs(1));
  EXPECT_NEAR(figure.curves("curve r")[0].first.y, -10.0, 0.03);
}

TEST(ReportFigures, ColourPatchesSideBySide) {
  CalibrationReportData data;
  data.findings.colour.emplace();
  auto& colour = *data.findings.colour;
  colour.patches = {{{1.0, 0.0, 0.0}, {1.2, -0.1, 0.0}, 0.5},
                    {{0.2140, 0.2140, 0.2140}, {0.0, 0.0, 1.0}, 2.0}};
  colour.mean_delta_e = 1.25;
  colour.max_delta_e = 2.0;
  const Figure chart(html(data), "Colour chart: certificate above, found below");
  ASSERT_TRUE(chart.there());
  std::vector<std::string> fills;
  const std::string text = chart.text();
  for (std::size_t at = text.find("fill=\""); at != std::string::npos;
       at = text.find("fill=\"", at + 1)) {
    fills.push_back(text.substr(at + 6, 7));
  }
  EXPECT_THAT(fills, ::testing::ElementsAre("#ff0000", "#ff0000", "#7f7f7f", "#0000ff"));
  const std::regex bar("height=\"([0-9.]+)\" class=\"bar\"");
  std::vector<double> heights;
  for (std::sregex_iterator it(text.begin(), text.end(), bar), end; it != end; ++it) {
    heights.push_back(std::stod((*it)[1]));
  }
  ASSERT_THAT(heights, SizeIs(2));
  EXPECT_NEAR(heights[0] / heights[1], 0.25, 1e-3);
  EXPECT_THAT(html(CalibrationReportData{}), Not(HasSubstr("Colour chart")));
}

TEST(ReportFigures, NamesOfAxesAreEscaped) {
  const std::string hostile = "</figcaption><script>x</script>\"&";
  CalibrationReportData data;
  data.findings.stage.emplace();
  auto& stage = *data.findings.stage;
  stage.rig = rig::la2(350.0, 500.0);
  for (rig::Axis& axis : stage.rig.axes) axis.name = hostile;
  geometry::StageView view;
  view.joints.assign(stage.rig.axes.size(), deg(1.0));
  data.observations["stage_axes"].boards = {view};
  stage.views = {fitted(true)};
  stage.joint_residuals = {Eigen::Vector2d(1e-5, 1e-5)};
  data.findings.repeatability[hostile];
  data.findings.settling[hostile];
  data.observations["homing"].axes.push_back({hostile, {deg(1.0), deg(1.001)}, {}, {}});
  const std::string page = html(data);
  EXPECT_THAT(page, HasSubstr("Axis fit: &lt;/figcaption&gt;"));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;x&lt;/script&gt;&quot;&amp;: one place"));
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, Not(HasSubstr("\"&\"")));
}

}  // namespace
}  // namespace gonio::calibration_report
