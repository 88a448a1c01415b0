#include "gonio/instrument/calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "example_instrument.h"
#include "gonio/errors/errors.h"
#include "gonio/files/atomic_file.h"
#include "temporary_folder.h"

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
  written.sensor.response = {4011.0, 0.001, 1.0 / 300.0};
  written.sensor.shutter_offset_s = 3.1e-6;
  written.stray = {5.1e-4, 1.0 / 30000.0};
  written.sensor.bad_pixels = {{319, 255}, {0, 0}, {17, 3}};
  written.rig.keep_outs.push_back(
      {"post", {{1, Angle::from_degrees(80), Angle::from_degrees(90)}}});
  written.rig.lamp.links.at(0).lead_mm_per_turn = 2.5;
  written.rig.limits.footprint.sample_half_width_mm = 25.0;
  const Instrument read = instrument_from_json(to_json(written), "cal.json");
  EXPECT_EQ(to_json(read), to_json(written));
  EXPECT_EQ(read.lamp_field.c11, written.lamp_field.c11);
  EXPECT_EQ(read.sensor.response.scale_dn, 4011.0);
  EXPECT_EQ(read.sensor.response.c1, 0.001);
  EXPECT_EQ(read.sensor.response.c2, 1.0 / 300.0);
  EXPECT_EQ(read.sensor.shutter_offset_s, 3.1e-6);
  EXPECT_EQ(read.sensor.bad_pixels, written.sensor.bad_pixels);
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

/// The example's text with other last keys of the sensor; "" for none of them.
std::string with_sensor_keys(const std::string& keys) {
  std::string text = to_json(example_instrument());
  const auto from = text.find(",", text.find("\"prnu\""));
  const auto to = text.find("}", text.find("\"bad_pixels\""));
  return text.replace(from, to - from, keys);
}

TEST(CalibrationFile, ReadsOneThatIsOlderThanResponseOffsetAndBadPixels) {
  const Instrument read = instrument_from_json(with_sensor_keys(""), "cal.json");
  EXPECT_EQ(read.sensor.prnu, 0.006);
  EXPECT_EQ(read.sensor.response.linear_dn(4000.0), 4000.0);
  EXPECT_EQ(read.sensor.shutter_offset_s, 0.0);
  EXPECT_TRUE(read.sensor.bad_pixels.empty());
}

TEST(CalibrationFile, RefusesAListOfBadPixelsThatIsNone) {
  const auto refused = [](const std::string& list) {
    return refusal(with_sensor_keys(", \"bad_pixels\": " + list));
  };
  EXPECT_THAT(refused("7"), HasSubstr("cal.json: sensor.bad_pixels: found 7, expected a list"));
  EXPECT_THAT(refused("[[1, 2], [3]]"),
              HasSubstr("cal.json: sensor.bad_pixels[1]: found [3], expected two whole numbers"));
  EXPECT_THAT(refused("[[1, 2, 3]]"), HasSubstr("sensor.bad_pixels[0]: found [1,2,3]"));
  EXPECT_THAT(refused("[[1.5, 2]]"), HasSubstr("sensor.bad_pixels[0]: found [1.5,2]"));
  EXPECT_THAT(refused("[[-1, 2]]"), HasSubstr("sensor.bad_pixels[0]: found [-1,2]"));
  EXPECT_THAT(refused("[[18446744073709551615, 2]]"), HasSubstr("sensor.bad_pixels[0]"));
  EXPECT_THAT(refused("[12, 30]"), HasSubstr("sensor.bad_pixels[0]: found 12"));
  EXPECT_THAT(refused("{\"count\": 1}"), HasSubstr("sensor.bad_pixels: found {"));
  EXPECT_THAT(refused("[[320, 2]]"),
              HasSubstr("sensor.bad_pixels has [320, 2], expected [column, row] within 320 x 256"));
  EXPECT_THAT(refused("[[2, 256]]"), HasSubstr("sensor.bad_pixels has [2, 256]"));
  std::string many = "[";
  for (int i = 0; i < 820; ++i) many += "[" + std::to_string(i % 320) + ", 0],";
  many.back() = ']';
  EXPECT_THAT(refused(many), HasSubstr("sensor.bad_pixels is 820, expected at most 1 %"));
  for (const std::string& message : {refused("7"), refused("[[320, 2]]"), refused(many)}) {
    EXPECT_THAT(message, testing::Not(HasSubstr("\n")));
  }
}

TEST(CalibrationFile, RefusesAResponseThatDoesNotRiseOrAShutterOffsetThatIsNone) {
  const auto refused = [](const std::string& keys) { return refusal(with_sensor_keys(keys)); };
  EXPECT_THAT(refused(R"(, "response": {"scale_dn": 4031, "c1": -0.2, "c2": 0})"),
              HasSubstr("sensor.response.c1 is -0.2, expected -0.1 to 0.1"));
  EXPECT_THAT(refused(R"(, "response": {"scale_dn": 4031, "c1": 0, "c2": 0.11})"),
              HasSubstr("sensor.response.c2 is 0.11"));
  EXPECT_THAT(refused(R"(, "response": {"scale_dn": 0, "c1": 0, "c2": 0})"),
              HasSubstr("sensor.response.scale_dn is 0"));
  EXPECT_THAT(refused(R"(, "response": {"scale_dn": 400, "c1": 0.01, "c2": 0})"),
              HasSubstr("sensor.response.scale_dn is 400"));
  EXPECT_THAT(refused(R"(, "response": {"scale_dn": 4031, "c1": 0.01})"),
              HasSubstr("cal.json: sensor.response.c2: missing"));
  EXPECT_THAT(refused(R"(, "response": 2.2)"), HasSubstr("sensor.response: found 2.2"));
  EXPECT_THAT(refused(R"(, "shutter_offset_s": 3.0)"),
              HasSubstr("sensor.shutter_offset_s is 3, expected -0.001 to 0.001"));
  EXPECT_THAT(refused(R"(, "shutter_offset_s": "3 us")"),
              HasSubstr("sensor.shutter_offset_s: found \"3 us\", expected a number"));
}

TEST(CalibrationFile, RefusesALinkToAnAxisThatDoesNotExist) {
  EXPECT_THAT(refusal(replaced(to_json(example_instrument()), "\"axis\": \"lamp_arm\"",
                               "\"axis\": \"lamp\"")),
              HasSubstr("cal.json"));
}

TEST(CalibrationFile, ConstantsOfACalibrationAreReadBesideTheirArchiveOnly) {
  namespace fs = std::filesystem;
  const TemporaryFolder folder;
  fs::create_directory(folder.path() / "cal");
  const fs::path constants = folder.path() / "cal" / "instrument.json";
  const std::string text = calibrated_to_json(example_instrument());
  files::write_text_file(constants, text);
  const auto refused = [](const fs::path& path) {
    EXPECT_THAT([&] { read_calibration(path); },
                testing::ThrowsMessage<DataFormatError>(testing::AllOf(
                    HasSubstr(path.string()), HasSubstr("away from its calibration.json"))));
  };
  refused(constants);
  files::write_text_file(folder.path() / "cal" / "calibration.json", "");
  EXPECT_EQ(to_json(read_calibration(constants)), to_json(example_instrument()));
  fs::copy_file(constants, folder.path() / "copy.json");
  refused(folder.path() / "copy.json");
  fs::create_hard_link(constants, folder.path() / "instrument.json");
  refused(folder.path() / "instrument.json");
  fs::copy_file(constants, folder.path() / "cal" / "older.json");
  refused(folder.path() / "cal" / "older.json");
  fs::create_symlink(constants, folder.path() / "link.json");
  EXPECT_NO_THROW(read_calibration(folder.path() / "link.json"));
  EXPECT_THAT(refusal(replaced(text, "calibration.json", "../calibration.json")),
              HasSubstr("archive: found \"../calibration.json\""));
  // Without a calibration there is no age to lose.
  files::write_text_file(folder.path() / "bare.json", to_json(example_instrument()));
  EXPECT_NO_THROW(read_calibration(folder.path() / "bare.json"));
}

}  // namespace
}  // namespace gonio::instrument
