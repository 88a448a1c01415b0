// A calibration on the days after it was made: what has to be taken again, and what its constants
// then are.

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>

#include "finished_run.h"
#include "geometry_uncertainty.h"
#include "gonio/files/sha256.h"
#include "hidden_bench.h"
#include "temporary_folder.h"

namespace gonio::calibration::routine {
namespace {

using instrument::StepState;
using std::chrono::hours;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr hours kDay{24};

class AnotherDay : public ::testing::Test {
 protected:
  AnotherDay() : folder_{temporary_.path() / "cal"} {
    std::filesystem::copy(test::finished_run().folder.path, folder_.path,
                          std::filesystem::copy_options::recursive);
  }

  /// So many days and an hour after the calibration.
  static instrument::UtcSeconds day(int number) {
    return test::kCalibrated + (number - 1) * kDay + hours(1);
  }

  Routine opened(int on_day) const { return test::reopened(folder_, day(on_day)); }

  /// Takes what has to be taken, as `gonio calibrate` does, and says what it was.
  std::vector<std::string> taken_on(int number, const sim::SimOptions& world) {
    test::HiddenBench bench(world);
    Routine routine = opened(number);
    std::vector<std::string> taken;
    for (;;) {
      const auto open = instrument::steps_to_take(routine.archive(), day(number));
      if (open.empty() || taken.size() > instrument::calibration_steps().size()) return taken;
      routine.take(open.front(), bench.devices, {}, {});
      taken.push_back(open.front());
    }
  }

  std::vector<std::string> open_on(int number) const {
    return instrument::steps_to_take(opened(number).archive(), day(number));
  }

  void expect_constants_of_the_archive(int on_day) const {
    const Routine routine = opened(on_day);
    ASSERT_FALSE(routine.archive().instrument_sha256.empty());
    EXPECT_EQ(files::sha256_of_file(folder_.instrument()), routine.archive().instrument_sha256);
  }

  TemporaryFolder temporary_;
  Folder folder_;
};

TEST_F(AnotherDay, WhatHasExpiredIsStillKnown) {
  for (const int number : {2, 8, 31}) {
    const Routine routine = opened(number);
    EXPECT_EQ(routine.state_of("white"), StepState::expired) << number;
    EXPECT_EQ(routine.state_of("colour"), StepState::valid) << number;
    EXPECT_TRUE(routine.findings().white && routine.findings().colour && routine.findings().fields)
        << number;
  }
}

TEST_F(AnotherDay, TheTableOfTheManualIsTrue) {
  const sim::SimOptions world = test::another_day();
  EXPECT_THAT(open_on(1), IsEmpty());
  EXPECT_THAT(taken_on(2, world), ElementsAre("homing", "warm_up", "white", "verification"));
  expect_constants_of_the_archive(2);
  EXPECT_THAT(taken_on(8, world),
              ElementsAre("homing", "warm_up", "darks", "white", "verification"));
  expect_constants_of_the_archive(8);
  EXPECT_THAT(taken_on(31, world),
              ElementsAre("homing", "backlash", "settle_time", "warm_up", "darks", "linearity",
                          "photon_transfer", "bad_pixels", "sample_plane", "zero_offsets",
                          "flat_field", "white", "verification"));
  expect_constants_of_the_archive(31);
  EXPECT_THAT(open_on(31), IsEmpty());
}

TEST_F(AnotherDay, AHomingThatScattersMoreReachesAllThatItsSigmaIsIn) {
  sim::SimOptions world = test::another_day();
  for (auto& axis : world.axes) axis.homing_sigma = Angle::from_degrees(0.004);
  const Routine before = opened(2);
  test::HiddenBench bench(world);
  Routine routine = opened(2);
  routine.take("homing", bench.devices, {}, {});

  const auto stored = [](const Routine& of) {
    return instrument::find_result(of.archive(), "zero_offsets")->covariance(0, 0);  // deg^2
  };
  const double scatter_deg = homing_scatter(routine.findings(), "azimuth").degrees();
  EXPECT_GT(stored(routine), stored(before) + 0.3 * scatter_deg * scatter_deg);
  EXPECT_GT(routine.instrument().u_normal.degrees(), 0.0035);
  EXPECT_EQ(routine.state_of("zero_offsets"), StepState::valid);
  const Routine again = opened(2);
  EXPECT_EQ(stored(again), stored(routine));
}

TEST_F(AnotherDay, ConstantsAreTheArchivesOrNotThere) {
  // As a kill between the writes leaves them.
  std::ofstream(folder_.instrument()) << "of another calibration";
  expect_constants_of_the_archive(1);
  std::filesystem::remove(folder_.instrument());
  expect_constants_of_the_archive(1);
  test::HiddenBench bench(test::another_day());
  Routine routine = opened(1);
  routine.take("linearity", bench.devices, {}, {});
  EXPECT_EQ(routine.state_of("flat_field"), StepState::stale);
  EXPECT_FALSE(routine.findings().fields || routine.findings().white)
      << "what is stale is not known, no more than to one who opens the folder";
  EXPECT_TRUE(routine.findings().stray && routine.findings().zeros);
  EXPECT_EQ(routine.archive().instrument_sha256, "");
  EXPECT_FALSE(std::filesystem::exists(folder_.instrument()));
  std::ofstream(folder_.instrument()) << "of another calibration";
  opened(1);
  EXPECT_FALSE(std::filesystem::exists(folder_.instrument()));
}

TEST_F(AnotherDay, WhatDoesNotPassWithOtherSettingsIsToBeTakenAgainAndTheFileKeepsIt) {
  RoutineSettings settings = test::HiddenBench::settings();
  settings.chart.linear_srgb.pop_back();
  const Routine routine = test::reopened(folder_, day(1), settings);
  EXPECT_EQ(routine.state_of("colour"), StepState::stale);
  EXPECT_THAT(routine.notices(),
              ElementsAre(HasSubstr("colour was made with other targets: colour_chart was")));
  EXPECT_FALSE(routine.findings().colour);
  EXPECT_EQ(routine.state_of("verification"), StepState::valid);
  EXPECT_THAT(open_on(1), IsEmpty());
}

TEST_F(AnotherDay, AChartThatIsNotToldAgainIsTheOneThatWasSeen) {
  RoutineSettings settings = test::HiddenBench::settings();
  settings.chart = {};
  const Routine routine = test::reopened(folder_, day(1), settings);
  EXPECT_THAT(routine.notices(), IsEmpty());
  ASSERT_TRUE(routine.findings().colour);
  EXPECT_EQ(routine.findings().colour->matrix, opened(1).findings().colour->matrix);
}

TEST_F(AnotherDay, WhatTheOperatorSaysOfATargetHoldsForWhatWasMadeWithIt) {
  struct Edit {
    std::function<void(RoutineSettings&)> edit;
    const char* told;
    std::vector<std::string> open;
  };
  const std::vector<std::string> behind_the_zeros{"zero_offsets", "flat_field", "white",
                                                  "verification"};
  const auto after = [&](const char* step) {
    std::vector<std::string> all{step};
    all.insert(all.end(), behind_the_zeros.begin(), behind_the_zeros.end());
    return all;
  };
  for (const Edit& each : {Edit{[](auto& s) { s.mirror.offset_mm = 1.0; },
                                "lamp_arm was made with other targets: mirror_raised_mm was 0, now "
                                "it is 1;",
                                after("lamp_arm")},
                           Edit{[](auto& s) { s.sample.u_raised_mm = 0.5; },
                                "sample_plane was made with other targets: u_sample_raised_mm was "
                                "0.05, now it is 0.5;",
                                after("sample_plane")},
                           Edit{[](auto& s) { s.black_glass_index = 1.6; },
                                "verification was made with other targets: black_glass_index was "
                                "1.52, now it is 1.6;",
                                {"verification"}}}) {
    RoutineSettings settings = test::HiddenBench::settings();
    each.edit(settings);
    const Routine routine = test::reopened(folder_, day(1), settings);
    EXPECT_THAT(routine.notices(), ElementsAre(HasSubstr(each.told)));
    EXPECT_EQ(instrument::steps_to_take(routine.archive(), day(1)), each.open);
    EXPECT_EQ(routine.archive().instrument_sha256, "");
  }
  EXPECT_THAT(open_on(1), IsEmpty()) << "until one is taken the folder is as it was";
  expect_constants_of_the_archive(1);
}

TEST_F(AnotherDay, SquaresOfTheBoardThatWereMeasuredStayTold) {
  RoutineSettings measured = test::HiddenBench::settings();
  measured.board_measured = true;
  const auto with_square = [&](double square_mm) {
    measured.board.square_mm = square_mm;
    return test::reopened(folder_, day(1), measured);
  };
  const auto stale = [](const char* was, const char* is) {
    return testing::UnorderedElementsAre(
        HasSubstr(fmt::format("intrinsics was made with other targets: board_square_mm was {}, now "
                              "it is {};",
                              was, is)),
        HasSubstr(fmt::format("stage_axes was made with other targets: board_square_mm was {}, now "
                              "it is {};",
                              was, is)));
  };
  EXPECT_THAT(with_square(9.75).notices(), stale("not told", "9.75"));

  instrument::CalibrationArchive archive = instrument::read_calibration_archive(folder_.archive());
  const auto tell = [&](const char* square_mm) {
    for (instrument::StepResult& result : archive.results) {
      if (result.step == "intrinsics" || result.step == "stage_axes") {
        result.told["board_square_mm"] = square_mm;
      }
    }
    instrument::write_calibration_archive(folder_.archive(), archive);
  };
  tell("9.75");
  EXPECT_THAT(with_square(9.75).notices(), IsEmpty());
  EXPECT_THAT(with_square(9.5).notices(), stale("9.75", "9.5"));
  const Routine not_said_again = opened(1);
  EXPECT_THAT(not_said_again.notices(), IsEmpty());
  EXPECT_EQ(not_said_again.settings().board.square_mm, 9.75);
  // Corrected, and interrupted after the first of the two that saw the board.
  for (instrument::StepResult& result : archive.results) {
    if (result.step != "intrinsics") continue;
    result.told["board_square_mm"] = "9.5";
    result.finished += hours(1);
    result.valid_until += hours(1);
  }
  instrument::write_calibration_archive(folder_.archive(), archive);
  const Routine goes_on = test::reopened(folder_, day(1) + hours(1));
  EXPECT_EQ(goes_on.settings().board.square_mm, 9.5);
  EXPECT_EQ(goes_on.state_of("intrinsics"), StepState::valid);
  EXPECT_EQ(goes_on.state_of("stage_axes"), StepState::stale);
  for (const char* none : {"wide", "-1", "nan", "9.75 mm", ""}) {
    tell(none);
    EXPECT_THROW(opened(1), std::invalid_argument) << none;
  }
}

TEST_F(AnotherDay, DarksOfAColderRoomAreTakenAgain) {
  instrument::CalibrationArchive archive = instrument::read_calibration_archive(folder_.archive());
  for (instrument::StepResult& result : archive.results) result.temperature_deg_c = 18.0;
  instrument::write_calibration_archive(folder_.archive(), archive);
  RoutineSettings settings = test::HiddenBench::settings();
  settings.temperature_deg_c = 20.0;
  EXPECT_THAT(test::reopened(folder_, day(1), settings).notices(), IsEmpty());
  settings.temperature_deg_c = 23.0;
  const Routine warmer = test::reopened(folder_, day(1), settings);
  EXPECT_THAT(warmer.notices(),
              ElementsAre(HasSubstr("darks was taken at 18.0 deg C, now it is 23.0")));
  // Others took a list of pixels from them, which does not follow the temperature.
  EXPECT_THAT(instrument::steps_to_take(warmer.archive(), day(1)), ElementsAre("darks"));
}

TEST_F(AnotherDay, WhatIsSeenAfterAnotherHomingIsSurerOfNothing) {
  Findings findings = opened(1).findings();
  const auto scatter = [&](const char* axis) { return homing_scatter(findings, axis).radians(); };
  namespace stage = geometry::stage_parameter;
  namespace lamp = geometry::lamp_parameter;
  const int then = findings.seen_after.at("stage_axes");
  EXPECT_TRUE(stage_after(findings, then).covariance == findings.stage->covariance);
  EXPECT_TRUE(lamp_after(findings, then).covariance == findings.lamp_arm->covariance);
  EXPECT_EQ(one_sigma_rigs_after(findings, then).size(), findings.zeros->one_sigma_rigs.size());

  const Eigen::MatrixXd more_stage =
      stage_after(findings, then + 1).covariance - findings.stage->covariance;
  for (const auto& [axis, at] :
       {std::pair{"azimuth", stage::kAzimuthOffset}, std::pair{"tilt", stage::kTiltOffset}}) {
    EXPECT_NEAR(more_stage(at, at) / (2.0 * std::pow(scatter(axis), 2)), 1.0, 1e-6) << axis;
  }
  const double more_lamp = lamp_after(findings, then + 1).covariance(lamp::kOffset, lamp::kOffset) -
                           findings.lamp_arm->covariance(lamp::kOffset, lamp::kOffset);
  EXPECT_NEAR(more_lamp / (2.0 * std::pow(scatter("lamp_arm"), 2)), 1.0, 1e-6);
  // Each of the three axes by the difference of two homings.
  const auto rigs = one_sigma_rigs_after(findings, then + 1);
  ASSERT_EQ(rigs.size(), findings.zeros->one_sigma_rigs.size() + 3);
  double squares = 0.0;
  for (std::size_t r = rigs.size() - 3; r < rigs.size(); ++r) {
    for (const auto chain : {&rig::RigDescription::lamp, &rig::RigDescription::sample}) {
      for (std::size_t i = 0; i < (rigs[r].rig.*chain).links.size(); ++i) {
        const Angle moved =
            (rigs[r].rig.*chain).links[i].offset - (findings.zeros->rig.*chain).links[i].offset;
        squares += moved.radians() * moved.radians();
      }
    }
  }
  EXPECT_NEAR(squares / (2.0 * (std::pow(scatter("azimuth"), 2) + std::pow(scatter("tilt"), 2) +
                                std::pow(scatter("lamp_arm"), 2))),
              1.0, 1e-6);
}

TEST_F(AnotherDay, NumbersThatAreNotWhatWasSeenAreWrittenAgain) {
  const auto number_in_file = [&] {
    const auto archive = instrument::read_calibration_archive(folder_.archive());
    return find_result(archive, "lamp_arm")->parameters.at(0).value;
  };
  const double found = number_in_file();
  instrument::CalibrationArchive edited = instrument::read_calibration_archive(folder_.archive());
  for (instrument::StepResult& result : edited.results) {
    if (result.step == "lamp_arm") result.parameters.at(0).value = 1e300;
    if (result.step == "white") result.checks.clear();
  }
  instrument::write_calibration_archive(folder_.archive(), edited);

  Folder to_look_at = folder_;
  to_look_at.read_only = true;
  const Routine looked = test::reopened(to_look_at, day(1));
  EXPECT_NEAR(find_result(looked.archive(), "lamp_arm")->parameters.at(0).value, found, 1e-6);
  EXPECT_EQ(number_in_file(), 1e300) << "somebody else may be at work in the folder";

  const Routine routine = opened(1);
  EXPECT_FALSE(find_result(routine.archive(), "white")->checks.empty());
  EXPECT_NEAR(number_in_file(), found, 1e-6);
  EXPECT_THAT(open_on(1), IsEmpty());
  expect_constants_of_the_archive(1);
}

TEST_F(AnotherDay, EveryHomingHasANumberOfItsOwn) {
  const int first = opened(1).findings().seen_after.at("white");
  Routine second = opened(1);
  test::HiddenBench bench(test::another_day());
  second.take("backlash", bench.devices, {}, {});
  EXPECT_EQ(second.findings().seen_after.at("backlash"), first + 1);
  second.take("bad_pixels", bench.devices, {}, {});
  EXPECT_EQ(second.findings().seen_after.at("bad_pixels"), first + 1) << "homed once a process";
  second.take("homing", bench.devices, {}, {});
  EXPECT_EQ(second.findings().seen_after.at("homing"), first + 2);
}

TEST_F(AnotherDay, ARedoThatIsInterruptedLeavesNothingThatPassesForWhole) {
  opened(1).redo({"intrinsics"});  // and no more of it
  EXPECT_FALSE(std::filesystem::exists(folder_.instrument()));
  EXPECT_THAT(open_on(1), ElementsAre("intrinsics", "stage_axes", "sample_plane", "lamp_arm",
                                      "zero_offsets", "flat_field", "white", "verification"));
  const Routine routine = opened(1);
  EXPECT_EQ(routine.archive().instrument_sha256, "");
  EXPECT_FALSE(routine.findings().intrinsics || routine.findings().zeros);
  EXPECT_TRUE(routine.findings().stray);
}

TEST_F(AnotherDay, ATakingOfATimeToComeIsRefused) {
  EXPECT_THAT([&] { test::reopened(folder_, test::kCalibrated - kDay); },
              testing::ThrowsMessage<std::invalid_argument>(
                  testing::AllOf(HasSubstr("calibration.json"), HasSubstr("which is to come"))));
}

TEST_F(AnotherDay, WhatSawTheWhiteSeesItAgainWithAnotherCertificate) {
  instrument::Instrument nominal = test::HiddenBench::nominal(sim::HiddenImage::small);
  nominal.white.reflectance *= 0.5;
  const Routine routine(nominal, test::HiddenBench::settings(), folder_, {{"camera", "sim"}},
                        [] { return day(1); });
  EXPECT_THAT(instrument::steps_to_take(routine.archive(), day(1)),
              ElementsAre("flat_field", "stray_light", "white", "colour", "verification"));
  EXPECT_EQ(routine.archive().instrument_sha256, "");
  EXPECT_THAT(open_on(1), IsEmpty()) << "until one is taken the folder is as it was";
}

TEST_F(AnotherDay, AnArchiveWhoseStepRestsOnNothingIsRefused) {
  instrument::CalibrationArchive archive = instrument::read_calibration_archive(folder_.archive());
  std::erase_if(archive.results, [](const auto& result) { return result.step == "intrinsics"; });
  instrument::write_calibration_archive(folder_.archive(), archive);
  const Routine routine = opened(1);  // all that needs it is stale
  EXPECT_EQ(routine.state_of("stage_axes"), StepState::stale);
  Findings findings;
  const Observations nothing;
  EXPECT_THAT(
      [&] {
        evaluate("stage_axes", nothing, test::HiddenBench::nominal(sim::HiddenImage::small),
                 routine.settings(), findings);
      },
      testing::ThrowsMessage<std::invalid_argument>(testing::HasSubstr("found nothing of "
                                                                       "intrinsics")));
}

}  // namespace
}  // namespace gonio::calibration::routine
