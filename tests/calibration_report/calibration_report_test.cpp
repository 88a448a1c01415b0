#include "gonio/calibration_report/calibration_report.h"

#include <gmock/gmock.h>

#include <string>

namespace gonio::calibration_report {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr instrument::UtcSeconds kNoon{std::chrono::seconds(1'700'000'000)};

CalibrationReportData with_darks() {
  CalibrationReportData data;
  data.rig = "bench-7";
  data.now = kNoon;
  instrument::StepResult darks;
  darks.step = "darks";
  darks.finished = kNoon - std::chrono::hours(1);
  darks.valid_until = kNoon + std::chrono::hours(24);
  darks.parameters = {{"sensor.black_level_dn", "DN", 64.125}};
  darks.covariance = Eigen::MatrixXd::Constant(1, 1, 0.25);
  darks.checks = {{"bad fraction", 0.002, 0.0013}};
  data.archive.results.push_back(darks);
  return data;
}

TEST(CalibrationReport, ShowsTheFindingsOwnNumbers) {
  const std::string page = html(with_darks());
  EXPECT_THAT(page, HasSubstr("sensor.black_level_dn = 64.125 ± 0.5 DN"));
  EXPECT_THAT(page, HasSubstr("bad fraction: 0.0013 / 0.002 <b>passed</b>"));
  EXPECT_THAT(page, HasSubstr("style=\"width:65%\""));
  EXPECT_THAT(page, HasSubstr("until 2023-11-15 22:13 UTC"));
}

TEST(CalibrationReport, SaysWhatIsMissingStaleOrRefused) {
  CalibrationReportData data = with_darks();
  EXPECT_THAT(html(data), HasSubstr("Incomplete: 17 missing, 0 stale, 0 expired"));
  EXPECT_THAT(html(data), HasSubstr("not valid as a whole"));
  data.now = kNoon + std::chrono::hours(25);
  EXPECT_THAT(html(data), HasSubstr("Incomplete: 17 missing, 0 stale, 1 expired"));
  data.refused = {{"linearity", "too few levels"}};
  EXPECT_THAT(html(data), HasSubstr("Refused: 1 of the steps"));
  EXPECT_THAT(html(data), HasSubstr("<b>Refused:</b> too few levels"));
}

TEST(CalibrationReport, EscapesHostileText) {
  const std::string hostile = "<script>alert('x')</script>\"&";
  CalibrationReportData data = with_darks();
  data.rig = hostile;
  data.archive.serials = {{hostile, hostile}};
  data.archive.results[0].notes = {hostile};
  data.archive.results[0].checks[0].name = hostile;
  data.refused = {{"linearity", hostile}};
  data.observations["backlash"].axes.push_back(
      {hostile,
       {},
       {{Angle::from_degrees(1.0), true, Angle::from_degrees(1.0), Angle::from_degrees(1.01)}},
       {}});
  data.findings.verification.emplace();
  data.findings.verification->explanation = hostile;
  const std::string page = html(data);
  EXPECT_THAT(page, Not(HasSubstr("<script")));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;"));
}

TEST(CalibrationReport, ShowsAFailedVerificationWithItsCause) {
  CalibrationReportData data = with_darks();
  calibration::Verification v;
  v.checks = {{"white (relative)", 0.015, 0.04}};
  v.cause = calibration::Cause::stale_white;
  v.explanation = "the white is old";
  data.findings.verification = v;
  const std::string page = html(data);
  EXPECT_THAT(page, HasSubstr("Failed: a check is beyond its limit"));
  EXPECT_THAT(page, HasSubstr("white (relative): 0.04 / 0.015 <b>FAILED</b>"));
  EXPECT_THAT(page, HasSubstr("the white is old"));
}

TEST(CalibrationReport, DrawsOnePointPerLevelAndLoadsNothing) {
  CalibrationReportData data = with_darks();
  EXPECT_THAT(html(data), Not(HasSubstr("<circle")));
  calibration::sensor::PhotonTransfer ptc;
  ptc.gain_dn_per_e = {0.3912, 0.002};
  ptc.points = {{0.1, 100.0, 40.0, 40.5, true}, {0.2, 200.0, 80.0, 79.5, true}};
  data.findings.photon_transfer = ptc;
  const std::string page = html(data);
  EXPECT_THAT(page, HasSubstr("<dt>Gain</dt><dd>0.3912 ± 0.0020 DN/e</dd>"));
  std::size_t circles = 0;
  for (std::size_t at = page.find("<circle"); at != std::string::npos;
       at = page.find("<circle", at + 1)) {
    ++circles;
  }
  EXPECT_EQ(circles, 4U);  // two on the curve, two residuals
  EXPECT_THAT(page, Not(HasSubstr("src=")));
  EXPECT_THAT(page, Not(HasSubstr("href=")));
}

}  // namespace
}  // namespace gonio::calibration_report
