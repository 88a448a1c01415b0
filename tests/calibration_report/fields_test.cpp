// The maps of lamp and picture, on a rig whose geometry the instrument knows.

#include <gmock/gmock.h>

#include <cmath>
#include <numbers>

#include "gonio/calibration_report/calibration_report.h"
#include "hidden_bench.h"
#include "page_reading.h"

namespace gonio::calibration_report {
namespace {

using test::Figure;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;
namespace routine = calibration::routine;

constexpr double kSlope = 0.4;  // of the lamp field along its x, per tangent
constexpr double kConstant = 1000.0;

/// The white in one pose, seen as the instrument says but for 0.3 % too bright left of the middle.
CalibrationReportData with_fields() {
  CalibrationReportData data;
  data.instrument = routine::test::HiddenBench::nominal(sim::HiddenImage::small);
  data.instrument.lamp_field.c10 = kSlope;
  data.findings.fields.emplace();
  data.findings.fields->lamp_field = data.instrument.lamp_field;
  data.findings.fields->constant = {kConstant, kConstant, kConstant};
  calibration::WhiteView view;
  view.joints = data.instrument.rig.home();
  view.joints[data.instrument.rig.lamp.links.at(0).axis] = Angle::from_degrees(45.0);
  for (double row = 190.0; row <= 320.0; row += 10.0) {
    for (double column = 240.0; column <= 370.0; column += 10.0) {
      calibration::PixelSignal pixel{column, row, 1.0, 0.001};
      const auto factor = calibration::white_factor(data.instrument, view, pixel);
      if (!factor) continue;
      pixel.dn_per_s = kConstant * factor->per_constant * (column < 305.0 ? 1.003 : 1.0);
      view.pixels.push_back(pixel);
    }
  }
  data.observations["flat_field"].whites = {view};
  return data;
}

TEST(ReportFields, FlatFieldResidualsOverThePicture) {
  const CalibrationReportData data = with_fields();
  ASSERT_THAT(data.observations.at("flat_field").whites[0].pixels, SizeIs(14 * 14));
  const Figure map(html(data), "Flat field: seen less fitted over the picture");
  const auto above = map.fields("above");
  const auto below = map.fields("below");
  int strong = 0;
  for (const auto& field : above) {
    if (field.x < 280.0) {
      EXPECT_NEAR(field.strength, 0.3 / 0.5, 1e-3);
      EXPECT_GT(field.x, 230.0);
      EXPECT_GT(field.y, 180.0);
      EXPECT_LT(field.y, 330.0);
      ++strong;
    } else if (field.x > 330.0) {
      EXPECT_NEAR(field.strength, 0.0, 1e-3);
    }
  }
  for (const auto& field : below) EXPECT_NEAR(field.strength, 0.0, 1e-3);
  EXPECT_GE(strong, 6);
  EXPECT_THAT(map.text(), HasSubstr("Mean of 196 readings"));
}

TEST(ReportFields, LampFieldAndWhatTheViewsCovered) {
  const std::string page = html(with_fields());
  const Figure map(page, "Lamp field: intensity, that on the axis 100 %");
  const auto above = map.fields("above");
  const auto below = map.fields("below");
  EXPECT_EQ(above.size() + below.size(), 25U * 25U);
  // Brighter to the right of the axis, darker to the left, in proportion to the tangent.
  double at_one = 0.0;
  double x_one = 0.0;
  for (const auto& field : above) {
    EXPECT_GT(field.x, -0.1);
    if (field.strength > 0.2 && field.strength < 0.9) {
      at_one = field.strength;
      x_one = field.x;
    }
  }
  for (const auto& field : below) EXPECT_LT(field.x, 0.1);
  ASSERT_GT(at_one, 0.0);
  const double tangent = std::tan(x_one * std::numbers::pi / 180.0);
  // Full colour is a round number: 1, 2 or 5 times a power of ten, in per cent.
  const double full_percent = 100.0 * kSlope * tangent / at_one;
  const double digits = full_percent / std::pow(10.0, std::floor(std::log10(full_percent) + 0.02));
  EXPECT_TRUE(std::abs(digits - 1.0) < 0.05 || std::abs(digits - 2.0) < 0.1 ||
              std::abs(digits - 5.0) < 0.25)
      << full_percent;
  EXPECT_THAT(map.curves("curve g"), SizeIs(1));
  EXPECT_THAT(map.text(), HasSubstr("class=\"veil\""));
}

TEST(ReportFields, FalloffIsThatOfTheFit) {
  CalibrationReportData data = with_fields();
  data.findings.fields->vignetting.v1 = -2.0;
  const Figure curve(html(data), "Falloff of the lens");
  ASSERT_THAT(curve.curves("curve r"), SizeIs(1));
  ASSERT_THAT(curve.curves("curve b"), SizeIs(1));
  const auto [first, seen_last] = curve.curves("curve r")[0];
  const auto [beyond_first, last] = curve.curves("curve b")[0];
  EXPECT_NEAR(first.y, 100.0, 0.1);
  EXPECT_LT(seen_last.x, last.x);
  EXPECT_NEAR(beyond_first.x, seen_last.x, 1e-3) << "it goes on where the white ends";
  const double tangent = std::tan(last.x * std::numbers::pi / 180.0);
  EXPECT_NEAR(tangent, 0.5 * std::hypot(612.0, 512.0) / 1381.0, 1e-3);
  EXPECT_NEAR(last.y, 100.0 * (1.0 - 2.0 * tangent * tangent), 0.2);
}

TEST(ReportFields, ViewsOfAnotherRigAreNotDrawn) {
  CalibrationReportData data = with_fields();
  data.observations["flat_field"].whites[0].joints.pop_back();
  const std::string page = html(data);
  EXPECT_FALSE(Figure(page, "Flat field: seen less fitted over the picture").there());
  EXPECT_FALSE(Figure(page, "Lamp field: intensity, that on the axis 100 %").there());
}

}  // namespace
}  // namespace gonio::calibration_report
