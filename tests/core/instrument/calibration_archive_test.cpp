#include "gonio/instrument/calibration_archive.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>

#include "example_instrument.h"
#include "gonio/errors/errors.h"
#include "temporary_folder.h"

namespace gonio::instrument {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr UtcSeconds kNoon{std::chrono::seconds(1800000000)};

StepResult result_of(const CalibrationArchive& archive, std::string_view step, UtcSeconds at,
                     double value = 1.0) {
  StepResult result;
  result.step = step;
  result.finished = at;
  result.valid_until = at + find_calibration_step(step)->valid;
  result.inputs = inputs_of(archive, step, at);
  result.parameters = {{"first", "px", value}, {"second", "", 1.0 / 3.0}};
  result.covariance = Eigen::Matrix2d{{4e-6, 1e-9}, {1e-9, 1e-12}};
  result.residuals = {{"rms_px", 0.03}};
  result.checks = {{"rms", 0.1, 0.03}};
  result.raw_data = {{"frames/1.tif", std::string(64, 'a')}};
  result.notes = {"twelve views"};
  return result;
}

/// A whole calibration.
CalibrationArchive whole(UtcSeconds at = kNoon) {
  CalibrationArchive archive;
  archive.rig_sha256 = rig_sha256(example_instrument());
  archive.white_sha256 = white_sha256(example_instrument().white);
  archive.serials = {{"camera", "22001122"}};
  for (const CalibrationStep& step : calibration_steps()) {
    record(archive, result_of(archive, step.name, at));
    archive.results.back().temperature_deg_c = 22.5;
  }
  return archive;
}

CalibrationUse use_at(UtcSeconds now) {
  return {rig_sha256(example_instrument()), white_sha256(example_instrument().white),
          std::map<std::string, std::string>{{"camera", "22001122"}}, now};
}

TEST(CalibrationSteps, NeedOnlyEarlierOnes) {
  std::set<std::string_view> earlier;
  for (const CalibrationStep& step : calibration_steps()) {
    for (const auto need : step.needs) EXPECT_TRUE(earlier.contains(need)) << step.name;
    for (const auto lender : step.borrows) EXPECT_TRUE(earlier.contains(lender)) << step.name;
    EXPECT_TRUE(earlier.insert(step.name).second) << step.name;
    EXPECT_GT(step.valid.count(), 0);
  }
  EXPECT_EQ(find_calibration_step("darkness"), nullptr);
}

TEST(CalibrationArchive, WholeAndFreshItMayBeUsed) {
  EXPECT_THAT(reasons_against(whole(), use_at(kNoon)), IsEmpty());
  EXPECT_THAT(steps_to_take(whole(), kNoon), IsEmpty());
}

TEST(CalibrationArchive, NewResultMakesAllThatRestOnItStale) {
  CalibrationArchive archive = whole();
  record(archive, result_of(archive, "intrinsics", kNoon + std::chrono::hours(1), 2.0));
  for (const char* step : {"stage_axes", "sample_plane", "lamp_arm", "zero_offsets", "flat_field",
                           "white", "verification"}) {
    EXPECT_EQ(state_of(archive, step, kNoon), StepState::stale) << step;
  }
  // Trap and chart keep the white of their day.
  for (const char* step :
       {"darks", "photon_transfer", "backlash", "intrinsics", "stray_light", "colour"}) {
    EXPECT_EQ(state_of(archive, step, kNoon), StepState::valid) << step;
  }
  EXPECT_EQ(steps_to_take(archive, kNoon).front(), "stage_axes");
  EXPECT_EQ(steps_to_take(archive, kNoon).size(), 7U);
  EXPECT_FALSE(is_whole(archive, kNoon));
}

TEST(CalibrationArchive, WhatIsToBeRedoneIsStaleUntilItIsTakenWithAllThatRestsOnIt) {
  CalibrationArchive archive = whole();
  archive.redo = {"linearity"};
  archive = calibration_archive_from_json(to_json(archive), "archive.json");
  EXPECT_EQ(state_of(archive, "linearity", kNoon), StepState::stale);
  EXPECT_THAT(steps_to_take(archive, kNoon),
              ElementsAre("linearity", "photon_transfer", "flat_field", "white", "verification"));
  EXPECT_FALSE(is_whole(archive, kNoon));
  EXPECT_THAT(reasons_against(archive, use_at(kNoon)),
              testing::Contains(HasSubstr("linearity is stale")));
  record(archive, result_of(archive, "linearity", kNoon));
  EXPECT_EQ(state_of(archive, "linearity", kNoon), StepState::valid);
  archive.redo = {"linearty"};
  EXPECT_THROW(archive.validate(), std::invalid_argument);
}

TEST(CalibrationArchive, ATakingOfATimeToComeIsARefusal) {
  CalibrationArchive archive = whole();
  EXPECT_THAT(dates_to_come(archive, kNoon - std::chrono::minutes(5)), IsEmpty());
  record(archive, result_of(archive, "homing", kNoon + std::chrono::hours(24 * 365)));
  EXPECT_THAT(dates_to_come(archive, kNoon),
              ElementsAre(HasSubstr("homing finished: found 2028-01-15 08:00 UTC, which is to come "
                                    "(it is 2027-01-15 08:00 now)")));
  EXPECT_THAT(reasons_against(archive, use_at(kNoon)),
              ElementsAre(HasSubstr("homing finished: found")));
}

TEST(CalibrationArchive, OtherTargetsAreARefusalOfWhatUsedThem) {
  CalibrationArchive archive = whole();
  StepResult result = *find_result(archive, "lamp_arm");
  result.told = {{"mirror_raised_mm", "0"}, {"u_mirror_raised_mm", "0.02"}};
  record(archive, result);
  archive = calibration_archive_from_json(to_json(archive), "archive.json");
  CalibrationUse use = use_at(kNoon);
  use.told = {{"mirror_raised_mm", "0"}, {"u_mirror_raised_mm", "0.02"}};
  EXPECT_THAT(reasons_against(archive, use), IsEmpty());
  use.told["mirror_raised_mm"] = "1";
  EXPECT_THAT(reasons_against(archive, use),
              ElementsAre("lamp_arm was made with other targets: mirror_raised_mm was 0, now it is "
                          "1; gonio calibrate takes it again"));
  use.told["black_glass_index"] = "1.6";  // of a result that does not say: an earlier version's
  EXPECT_THAT(reasons_against(archive, use),
              testing::Contains(HasSubstr("verification was made with other targets: "
                                          "black_glass_index was not told, now it is 1.6")));
  result.told["black_glass_index"] = "1.5";
  EXPECT_THROW(record(archive, result), std::invalid_argument);
}

TEST(CalibrationArchive, DarksHoldForTheirTemperature) {
  const CalibrationArchive archive =
      calibration_archive_from_json(to_json(whole()), "archive.json");
  const StepResult& darks = *find_result(archive, "darks");
  EXPECT_EQ(darks.temperature_deg_c, 22.5);
  EXPECT_EQ(at_another_temperature(darks, 25.4), "");
  EXPECT_EQ(at_another_temperature(darks, 19.6), "");
  EXPECT_THAT(at_another_temperature(darks, 25.6),
              HasSubstr("darks was taken at 22.5 deg C, now it is 25.6"));
  EXPECT_THAT(at_another_temperature(darks, 19.4), HasSubstr("now it is 19.4"));
  EXPECT_EQ(at_another_temperature(*find_result(archive, "white"), 40.0), "");
  StepResult not_told = darks;
  not_told.temperature_deg_c.reset();
  EXPECT_EQ(at_another_temperature(not_told, 40.0), "");
}

TEST(CalibrationArchive, KnowsBeforehandWhichStepsCannotBeTaken) {
  const auto refused = [](const CalibrationArchive& archive, const std::vector<std::string>& steps,
                          const char* says) {
    EXPECT_THAT([&] { require_takeable(archive, steps, kNoon); },
                testing::ThrowsMessage<std::invalid_argument>(HasSubstr(says)));
  };
  CalibrationArchive empty;
  refused(empty, {"darks", "stage_axes"}, "stage_axes needs intrinsics, which is missing");
  EXPECT_NO_THROW(require_takeable(empty, {"darks", "linearity", "photon_transfer"}, kNoon));
  EXPECT_NO_THROW(require_takeable(whole(), {"lamp_arm"}, kNoon));
  // Taken anew, the first makes stale what stands between them.
  refused(whole(), {"intrinsics", "lamp_arm"}, "lamp_arm needs stage_axes, which is stale");
}

TEST(CalibrationArchive, ADeviceWithoutIdentityIsNone) {
  CalibrationArchive archive = whole();
  archive.serials = {{"camera", ""}};
  EXPECT_THAT([&] { archive.validate(); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("serials: found \"\"")));
  archive.serials.clear();
  EXPECT_THAT(reasons_against(archive, use_at(kNoon)),
              ElementsAre(HasSubstr("says of no device that it was made with it")));
}

TEST(CalibrationArchive, NumbersHadAgainFromWhatWasSeenMakeNothingStale) {
  CalibrationArchive archive = whole();
  record(archive, result_of(archive, "intrinsics", kNoon, 2.0));
  EXPECT_THAT(steps_to_take(archive, kNoon), IsEmpty());
}

TEST(CalibrationArchive, WhatOnlyLendsASigmaMakesNothingStale) {
  CalibrationArchive archive = whole();
  const UtcSeconds tomorrow = kNoon + std::chrono::hours(25);
  record(archive, result_of(archive, "homing", tomorrow));
  EXPECT_THAT(steps_to_take(archive, tomorrow), ElementsAre("warm_up", "white", "verification"));
  EXPECT_TRUE(is_whole(archive, tomorrow));
}

TEST(CalibrationArchive, TheSameResultAgainMakesNothingStale) {
  CalibrationArchive archive = whole();
  record(archive, *find_result(archive, "intrinsics"));
  EXPECT_THAT(steps_to_take(archive, kNoon), IsEmpty());
  EXPECT_EQ(archive.results.size(), calibration_steps().size());
}

TEST(CalibrationArchive, WhatHasExpiredIsTakenAgainWithWhatRestsOnIt) {
  const CalibrationArchive archive = whole();
  const UtcSeconds in_two_days = kNoon + std::chrono::hours(48);
  EXPECT_EQ(state_of(archive, "white", in_two_days), StepState::expired);
  EXPECT_EQ(state_of(archive, "darks", in_two_days), StepState::valid);
  EXPECT_THAT(steps_to_take(archive, in_two_days),
              ElementsAre("homing", "warm_up", "white", "verification"));
  EXPECT_THAT(reasons_against(archive, use_at(in_two_days)),
              testing::Contains(HasSubstr("white is expired since 2027-01-16 08:00 UTC: gonio "
                                          "calibrate takes it")));
}

TEST(CalibrationArchive, NothingIsMeasuredOnGroundThatDoesNotHold) {
  CalibrationArchive archive;
  archive.rig_sha256 = std::string(64, '0');
  EXPECT_THAT(
      [&] { inputs_of(archive, "bad_pixels", kNoon); },
      testing::ThrowsMessage<std::invalid_argument>(HasSubstr("needs darks, which is missing")));
  EXPECT_THROW(state_of(archive, "darkness", kNoon), std::invalid_argument);
}

TEST(CalibrationArchive, AnotherRigOrCameraIsARefusal) {
  CalibrationUse use = use_at(kNoon);
  Instrument other = example_instrument();
  other.rig.axes[1].max += Angle::from_degrees(1.0);
  use.rig_sha256 = rig_sha256(other);
  use.serials->at("camera") = "22001123";
  EXPECT_THAT(reasons_against(whole(), use),
              ElementsAre(HasSubstr("another rig"),
                          HasSubstr("camera: found \"22001123\", expected \"22001122\"")));
}

TEST(CalibrationArchive, AnotherLensIsAnotherRigButAnotherUncertaintyIsNot) {
  Instrument other = example_instrument();
  other.u_normal = Angle::from_degrees(1.0);
  other.id = "another day";
  EXPECT_EQ(rig_sha256(other), rig_sha256(example_instrument()));
  other.camera.cx_px += 1.0;
  EXPECT_NE(rig_sha256(other), rig_sha256(example_instrument()));
}

TEST(CalibrationArchive, AnotherCertificateOfTheWhiteIsARefusal) {
  Instrument other = example_instrument();
  other.white.reflectance *= 0.5;
  EXPECT_EQ(rig_sha256(other), rig_sha256(example_instrument()));
  CalibrationUse use = use_at(kNoon);
  use.white_sha256 = white_sha256(other.white);
  EXPECT_THAT(reasons_against(whole(), use), ElementsAre(HasSubstr("made with another white")));
}

TEST(CalibrationArchive, NoResultIsGoodForLongerThanItsKind) {
  CalibrationArchive archive = whole();
  archive.results.front().valid_until += std::chrono::hours(24 * 365 * 100);
  EXPECT_THAT([&] { archive.validate(); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("valid_until")));
}

TEST(CalibrationArchive, DeviceThatIsNotThereIsARefusalButNotOneNotLookedForYet) {
  CalibrationUse use = use_at(kNoon);
  use.serials->clear();
  EXPECT_THAT(reasons_against(whole(), use),
              ElementsAre(HasSubstr("camera: found no such device, expected \"22001122\"")));
  use.serials->emplace("monitor", "22001122");  // the serial alone does not make it the camera
  EXPECT_THAT(reasons_against(whole(), use), ElementsAre(HasSubstr("camera: found no such")));
  use.serials.reset();
  EXPECT_THAT(reasons_against(whole(), use), IsEmpty());
}

TEST(CalibrationArchive, RefusesResultsThatAreNone) {
  const CalibrationArchive archive = whole();
  const auto refused = [&](const std::function<void(StepResult&)>& spoil, const char* says) {
    StepResult result = *find_result(archive, "photon_transfer");
    spoil(result);
    CalibrationArchive copy = archive;
    EXPECT_THAT([&] { record(copy, result); },
                testing::ThrowsMessage<std::invalid_argument>(HasSubstr(says)));
    EXPECT_EQ(to_json(copy), to_json(archive));
  };
  refused([](StepResult& r) { r.step = "darkness"; }, "no step of that name");
  refused([](StepResult& r) { r.checks[0].found = 2.0 * r.checks[0].limit + 1.0; },
          "only what passed is kept");
  refused([](StepResult& r) { r.inputs.clear(); }, "inputs: found 0, expected 2");
  refused([](StepResult& r) { r.inputs["white"] = std::string(64, 'b'); },
          "does not use \"white\"");
  refused([](StepResult& r) { r.inputs["darks"] = "b"; }, "64 hexadecimal");
  refused([](StepResult& r) { r.valid_until = r.finished; }, "an end before the beginning");
  refused([](StepResult& r) { r.parameters[1].name = "first"; }, "name of its own");
  refused([](StepResult& r) { r.parameters[1].value = std::nan(""); }, "finite");
  refused([](StepResult& r) { r.covariance.resize(1, 1); }, "expected 2 x 2");
  refused([](StepResult& r) { r.covariance(0, 1) = 1e-8; }, "not symmetric");
  refused([](StepResult& r) { r.covariance(0, 1) = r.covariance(1, 0) = 3e-9; }, "semidefinite");
  refused([](StepResult& r) { r.covariance(1, 1) = -1.0; }, "negative variance");
  refused([](StepResult& r) { r.covariance(1, 1) = 0.0; }, "varies with others");
  refused([](StepResult& r) { r.residuals["x"] = std::nan(""); }, "residuals.x");
  refused([](StepResult& r) { r.raw_data[0].sha256 = "z"; }, "raw_data");
}

TEST(CalibrationArchiveFile, ReadsBackWhatItWrote) {
  const TemporaryFolder folder;
  const CalibrationArchive archive = whole();
  write_calibration_archive(folder.path() / "archive.json", archive);
  write_calibration_archive(folder.path() / "archive.json", archive);  // replaces
  const CalibrationArchive read = read_calibration_archive(folder.path() / "archive.json");
  EXPECT_EQ(to_json(read), to_json(archive));
  EXPECT_EQ(read.results[3].covariance, archive.results[3].covariance);
  // Hashes of what was read are those of what was written: a file makes nothing stale.
  EXPECT_THAT(reasons_against(read, use_at(kNoon)), IsEmpty());
}

TEST(CalibrationArchiveFile, NamesTheBadPlace) {
  const std::string good = to_json(whole());
  const auto refused = [&](const std::string& from, const std::string& to, const char* says) {
    std::string text = good;
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    EXPECT_THAT([&] { calibration_archive_from_json(text, "archive.json"); },
                testing::ThrowsMessage<DataFormatError>(
                    testing::AllOf(HasSubstr("archive.json"), HasSubstr(says))))
        << from << " -> " << to;
  };
  refused("gonio-calibration-archive", "gonio-calibration", "format");
  refused("\"version\": 2", "\"version\": 1", "an older version");
  refused("\"temperature_deg_c\": 22.5", "\"temperature_deg_c\": \"warm\"", "temperature_deg_c");
  refused("\"camera\": \"22001122\"", "\"camera\": 22001122", "serials.camera");
  refused("\"step\": \"homing\"", "\"step\": \"darks\"", "found twice");
  refused("\"finished_utc_s\": 1800000000", "\"finished_utc_s\": 18000000000000000000",
          "results[0].finished_utc_s");
  refused("\"finished_utc_s\": 1800000000", "\"finished_utc_s\": 1.5", "finished_utc_s");
  refused("\"covariance\": [", "\"covariance\": [1.0,", "results[0].covariance");
  refused("\"notes\": [", "\"notes\": [1,", "results[0].notes");
  refused("\"rms_px\": 0.03", "\"rms_px\": \"small\"", "results[0].residuals.rms_px");
  refused("\"notes\"", "\"note\"", "notes");
  refused("}", "", "not valid JSON");
}

}  // namespace
}  // namespace gonio::instrument
