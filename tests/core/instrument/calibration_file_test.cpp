#include "gonio/instrument/calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "example_instrument.h"
#include "gonio/errors/errors.h"

namespace gonio::instrument {
namespace {

using testing::HasSubstr;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  if (at == std::string::npos) ADD_FAILURE() << "not in the text: " << from;
  return text.replace(at, from.size(), to);
}

std::string refusal(const std::string& text) {
  try {
    instrument_from_json(text, "cal.json");
  } catch (const DataFormatError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(CalibrationFile, ReadsBackWhatItWrote) {
  Instrument written = example_instrument();
  written.white.angular = {{0.0, 60.0}, {10.0, 45.0, 80.0}, {0.0, 180.0}, {}};
  for (int i = 0; i < 12; ++i) written.white.angular.factor.push_back(1.0 - 0.01 * i);
  written.lamp_field.c11 = 1.0 / 3.0;
  written.rig.keep_outs.push_back(
      {"post", {{1, Angle::from_degrees(80), Angle::from_degrees(90)}}});
  written.rig.lamp.links.at(0).lead_mm_per_turn = 2.5;
  written.rig.limits.footprint.sample_half_width_mm = 25.0;
  const Instrument read = instrument_from_json(to_json(written), "cal.json");
  EXPECT_EQ(to_json(read), to_json(written));
  EXPECT_EQ(read.lamp_field.c11, written.lamp_field.c11);
  EXPECT_EQ(read.rig.keep_outs.at(0).ranges.at(0).axis, 1U);
  EXPECT_EQ(read.white.angular.theta_o_deg, written.white.angular.theta_o_deg);
  EXPECT_EQ(read.white.angular.factor, written.white.angular.factor);
}

TEST(CalibrationFile, ReadsATableOfTheAngleOfIncidenceAlone) {
  const std::string text = replaced(to_json(example_instrument()), "\"angular\": []",
                                    R"("angular": [{"theta_i_deg": 0, "relative": 1.01},
                            {"theta_i_deg": 60, "relative": 0.93}])");
  const Instrument read = instrument_from_json(text, "cal.json");
  const double half_way = white_brdf(read.white, {{0.5, 0.0, std::sqrt(0.75)}, {0, 0.6, 0.8}})[0];
  EXPECT_NEAR(half_way, 0.99 * 0.97 / std::numbers::pi, 1e-12);
  EXPECT_THAT(to_json(read), HasSubstr("\"relative\": 0.93"));
}

TEST(CalibrationFile, RefusesAWhiteTableThatIsNone) {
  const auto refused = [](const std::string& table) {
    return refusal(
        replaced(to_json(example_instrument()), "\"angular\": []", "\"angular\": " + table));
  };
  EXPECT_THAT(refused(R"({"theta_i_deg": [0, 60], "theta_o_deg": [0], "delta_phi_deg": [0],
                          "factor": [1]})"),
              HasSubstr("cal.json: white.angular.factor: found [1], expected 2 numbers"));
  EXPECT_THAT(refused(R"({"theta_i_deg": [60, 0], "theta_o_deg": [0], "delta_phi_deg": [0],
                          "factor": [1, 1]})"),
              HasSubstr("white.angular.theta_i_deg is 0, expected ascending"));
  EXPECT_THAT(refused(R"({"theta_i_deg": [0], "theta_o_deg": [0], "delta_phi_deg": [0, 190],
                          "factor": [1, 1]})"),
              HasSubstr("white.angular.delta_phi_deg is 190, expected ascending"));
  EXPECT_THAT(refused(R"({"theta_i_deg": [0], "theta_o_deg": [0], "delta_phi_deg": [0],
                          "factor": [0]})"),
              HasSubstr("white.angular.factor is 0, expected above 0"));
  EXPECT_THAT(refused(R"({"theta_i_deg": [0], "theta_o_deg": [0], "factor": [1]})"),
              HasSubstr("white.angular.delta_phi_deg: missing"));
  EXPECT_THAT(refused("7"), HasSubstr("white.angular: found 7, expected an object"));
}

TEST(CalibrationFile, NamesAnUnknownKeyWithItsPlace) {
  EXPECT_THAT(refusal(replaced(to_json(example_instrument()), "\"prnu\"", "\"prmu\"")),
              HasSubstr("cal.json: sensor.prnu: missing"));
  EXPECT_THAT(
      refusal(replaced(to_json(example_instrument()), "\"prnu\"", "\"extra\": 1, \"prnu\"")),
      HasSubstr("cal.json: sensor.extra: unknown key"));
}

TEST(CalibrationFile, SaysWhatItFoundAndExpected) {
  const std::string good = to_json(example_instrument());
  EXPECT_THAT(refusal(replaced(good, "\"version\": 1", "\"version\": 7")),
              HasSubstr("version: found 7, expected 1"));
  EXPECT_THAT(refusal(replaced(good, "\"fx_px\": 1400.0", "\"fx_px\": \"wide\"")),
              HasSubstr("camera.fx_px: found \"wide\", expected a number"));
  EXPECT_THAT(refusal(replaced(good, "\"fx_px\": 1400.0", "\"fx_px\": -2.0")),
              HasSubstr("camera.fx_px is -2"));
  EXPECT_THAT(refusal(replaced(good, "\"fx_px\": 1400.0", "\"fx_px\": 1e999")),
              HasSubstr("cal.json"));
  EXPECT_THAT(refusal(good.substr(0, good.size() / 2)), HasSubstr("not valid JSON"));
  EXPECT_THAT(refusal("[]"), HasSubstr("expected an object"));
  EXPECT_THAT(refusal(std::string(1000000, '[')), HasSubstr("nested deeper than"));
}

TEST(CalibrationFile, RefusesALinkToAnAxisThatDoesNotExist) {
  EXPECT_THAT(refusal(replaced(to_json(example_instrument()), "\"axis\": \"lamp_arm\"",
                               "\"axis\": \"lamp\"")),
              HasSubstr("cal.json"));
}

}  // namespace
}  // namespace gonio::instrument
