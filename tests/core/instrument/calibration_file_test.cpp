#include "gonio/instrument/calibration_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

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
  written.white.angular = {{0.0, 1.01}, {60.0, 0.93}};
  written.lamp_field.c11 = 1.0 / 3.0;
  written.rig.keep_outs.push_back(
      {"post", {{1, Angle::from_degrees(80), Angle::from_degrees(90)}}});
  written.rig.lamp.links.at(0).lead_mm_per_turn = 2.5;
  written.rig.limits.footprint.sample_half_width_mm = 25.0;
  const Instrument read = instrument_from_json(to_json(written), "cal.json");
  EXPECT_EQ(to_json(read), to_json(written));
  EXPECT_EQ(read.lamp_field.c11, written.lamp_field.c11);
  EXPECT_EQ(read.rig.keep_outs.at(0).ranges.at(0).axis, 1U);
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
