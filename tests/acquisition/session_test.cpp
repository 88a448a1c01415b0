#include "gonio/acquisition/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "fake_rig.h"
#include "gonio/acquisition/guarded_devices.h"
#include "gonio/acquisition/preflight.h"
#include "gonio/acquisition/trust_notes.h"
#include "gonio/rig/paths.h"
#include "temporary_folder.h"

namespace gonio::acquisition {
namespace {

using testing::Contains;
using testing::HasSubstr;
using namespace gonio::literals;

const std::vector<std::array<double, 3>> kTwoDirections{{3.0, 12.0, 28.0}, {15.0, 30.0, 130.0}};

class Session : public testing::Test {
 protected:
  SessionResult run(std::stop_token stop = {}, const SessionPart& part = {}) {
    const MeasurementPlan plan = rig_.plan(directions_);
    SessionWriter archive(folder_, {}, {});
    DeviceSet devices = rig_.devices();
    if (!remarks_.empty()) devices.remarks = [this] { return remarks_; };
    return run_session(devices, rig_.known, plan, options_, archive, {}, std::move(stop), part);
  }
  std::string refusal() {
    try {
      run();
    } catch (const PreflightError& error) {
      return error.what();
    }
    return "accepted";
  }
  /// Homing is a move too.
  int moves() const {
    int sum = 0;
    for (const auto& stage : rig_.stages) sum += stage->moves + stage->homings;
    return sum;
  }
  void expect_safe() const {
    for (const auto& stage : rig_.stages) EXPECT_TRUE(stage->stopped) << stage->name();
    EXPECT_EQ(rig_.light.lit, "");
  }
  std::vector<PointRecord> points() const { return SessionReader(folder_).points(); }
  std::vector<FrameRecord> frames(FrameKind kind) const {
    const SessionReader archive(folder_);
    std::vector<FrameRecord> found;
    for (const FrameRecord& record : archive.frames()) {
      if (record.kind == kind) found.push_back(record);
    }
    return found;
  }

  TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path() / "session";
  FakeRig rig_;
  SessionOptions options_;
  std::vector<std::array<double, 3>> directions_ = kTwoDirections;
  std::vector<std::string> remarks_;
};

TEST_F(Session, MeasuresEveryPointInEveryChannelAndEndsSafe) {
  const SessionResult result = run();
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(result.measured, 2);
  expect_safe();
  const SessionReader archive(folder_);
  EXPECT_TRUE(archive.finished());
  EXPECT_EQ(archive.points().size(), 2U);
  std::map<std::pair<int, std::string>, int> per_channel;
  for (const FrameRecord& record : frames(FrameKind::sample)) {
    ++per_channel[{record.point, record.channel}];
  }
  EXPECT_EQ(per_channel.size(), 6U);
  EXPECT_EQ(frames(FrameKind::dark).size(), static_cast<std::size_t>(options_.dark_frames));
  EXPECT_EQ(frames(FrameKind::lamp_off).size(), 4U) << "two points, two visits to the white";
}

TEST_F(Session, TakesDarksFromACameraThatDoesNotSayWhereItIsFull) {
  rig_.camera.saturation_level_dn = 0;
  EXPECT_TRUE(run().complete);
}

TEST_F(Session, ShortensTheExposureUntilNothingSaturates) {
  rig_.camera.lit_dn_per_s = 2e6;  // 20 ms would be ten times saturation
  EXPECT_EQ(run().measured, 2);
  std::chrono::nanoseconds shortest = std::chrono::hours(1);
  for (const FrameRecord& record : frames(FrameKind::sample)) {
    shortest = std::min(shortest, record.exposure);
  }
  EXPECT_LT(std::chrono::duration<double>(shortest).count() * 2e6, 4095.0 - 64.0);
}

TEST_F(Session, ShortensNoExposureForABadPixel) {
  rig_.camera.full_pixels = {16 * 32 + 16, 12 * 32 + 18};
  rig_.known.sensor.bad_pixels = {{16, 16}, {18, 12}};
  EXPECT_EQ(run().measured, 2);
  for (const FrameRecord& record : frames(FrameKind::sample)) {
    EXPECT_GE(record.exposure, options_.first_exposure);
  }
}

TEST_F(Session, MovesNothingWhenTheShutterOffsetLeavesNothingOfTheShortestExposure) {
  rig_.known.sensor.shutter_offset_s = -60e-6;  // the camera's shortest is 50 us
  EXPECT_THAT(refusal(), HasSubstr("shutter_offset_s"));
  EXPECT_EQ(moves(), 0);
}

TEST_F(Session, LengthensTheExposureUntilTheSpotIsPreciseEnough) {
  rig_.camera.lit_dn_per_s = 40.0;  // 0.8 DN in 20 ms
  EXPECT_EQ(run().measured, 2);
  std::chrono::nanoseconds longest{0};
  for (const FrameRecord& record : frames(FrameKind::sample)) {
    longest = std::max(longest, record.exposure);
  }
  EXPECT_GT(std::chrono::duration<double>(longest).count() * 40.0, 20.0);
  EXPECT_LE(longest, options_.max_exposure);
}

TEST_F(Session, EndsWhenTheWhiteSaturatesInEveryExposure) {
  rig_.camera.lit_dn_per_s = 1e9;
  EXPECT_THROW(run(), devices::DeviceError);
  EXPECT_TRUE(SessionReader(folder_).points().empty());
  expect_safe();
}

TEST_F(Session, CallsAPointSaturatedWhenEvenTheShortestExposureIsFull) {
  rig_.camera.on_capture = [&] {
    rig_.camera.lit_dn_per_s = rig_.changer.mounted() == devices::Target::sample ? 1e9 : 50000.0;
  };
  const SessionResult result = run();
  EXPECT_EQ(result.measured, 0);
  EXPECT_FALSE(result.complete);
  EXPECT_EQ(points().at(0).outcome, PointOutcome::Saturated);
}

TEST_F(Session, ShortensTheExposureToTheLevelAtWhichTheCameraSaysItIsFull) {
  // A camera in another mode than the one that was calibrated: full at 1620 of 4095 DN.
  rig_.camera.saturation_level_dn = 1620;
  rig_.camera.full_dn = 1620.0;
  rig_.camera.lit_dn_per_s = 2e5;
  const SessionResult result = run();
  EXPECT_EQ(result.measured, 2);
  std::chrono::nanoseconds shortest = std::chrono::hours(1);
  for (const FrameRecord& record : frames(FrameKind::sample)) {
    shortest = std::min(shortest, record.exposure);
  }
  EXPECT_LT(std::chrono::duration<double>(shortest).count() * 2e5, 1620.0 - 64.0);
}

TEST_F(Session, ExposesNoLongerForWhatIsFullInTheShortestExposure) {
  rig_.camera.upper_half_dn_per_s = 1e9;
  options_.relative_sigma = 0.05;  // 400 electrons: the lower half has them in 20 ms
  EXPECT_EQ(run().measured, 2) << "the lower half is";
  for (const FrameRecord& record : frames(FrameKind::sample)) {
    EXPECT_LE(record.exposure, options_.first_exposure);
  }
}

TEST_F(Session, StoresHowFarAnAxisCreptDuringAnExposure) {
  rig_.camera.on_capture = [&] {
    if (rig_.light.lit == "G") rig_.stages[1]->creep(0.001_deg);
  };
  run();
  for (const FrameRecord& record : frames(FrameKind::sample)) {
    const double expected_deg = record.channel == "G" ? 0.0005 : 0.0;
    ASSERT_EQ(record.joints_spread.size(), 3U);
    EXPECT_NEAR(record.joints_spread[1].degrees(), expected_deg, 1e-9) << record.channel;
    EXPECT_EQ(record.joints_spread[0], Angle());
  }
}

TEST_F(Session, FailsAPointAtWhichAnAxisDoesNotStand) {
  bool crept = false;
  rig_.camera.on_capture = [&] {
    if (crept || rig_.light.lit.empty() || rig_.changer.mounted() != devices::Target::sample)
      return;
    crept = true;
    rig_.stages[1]->creep(0.06_deg);
  };
  run();
  EXPECT_EQ(points().at(0).outcome, PointOutcome::Failed);
  EXPECT_THAT(points().at(0).note, HasSubstr(rig_.stages[1]->name()));
  EXPECT_THAT(points().at(0).note, HasSubstr("during an exposure"));
  EXPECT_EQ(points().at(1).outcome, PointOutcome::Measured);
  expect_safe();
}

TEST_F(Session, FailsAPointAtWhichAnAxisCreepsALittleWithEachExposure) {
  rig_.camera.on_capture = [&] {
    if (rig_.changer.mounted() == devices::Target::sample) rig_.stages[1]->creep(0.03_deg);
  };
  options_.dark_frames = 1;
  run();
  EXPECT_EQ(points().at(0).outcome, PointOutcome::Failed);
}

TEST_F(Session, ReadsTheEncodersAgainWhenTheyDoNotAnswer) {
  int failures = 0;
  rig_.camera.on_capture = [&] {
    if (rig_.light.lit == "B") rig_.stages[0]->failing_readings = failures++ == 0 ? 1 : 0;
  };
  EXPECT_TRUE(run().complete);
}

TEST_F(Session, CallsAPointTooDarkWhenEvenTheLongestExposureIsEmpty) {
  rig_.camera.on_capture = [&] {
    rig_.camera.lit_dn_per_s = rig_.changer.mounted() == devices::Target::sample ? 0.01 : 50000.0;
  };
  run();
  EXPECT_EQ(points().at(0).outcome, PointOutcome::TooDark);
}

TEST_F(Session, EndsAtOnceWhenTheOpeningWhiteIsDark) {
  rig_.camera.on_capture = [&] {
    rig_.camera.lit_dn_per_s = rig_.light.lit == "G" ? 0.0 : 50000.0;
  };
  try {
    run();
    FAIL() << "measured without a white";
  } catch (const devices::DeviceError& error) {
    EXPECT_EQ(error.code(), devices::DeviceErrc::Fault);
    EXPECT_THAT(error.what(), HasSubstr("channel G"));
  }
  expect_safe();
}

TEST_F(Session, WarnsOfADarkClosingWhite) {
  int points = 0;
  rig_.stages[0]->on_move = [&](FakeStage&) { ++points; };
  rig_.camera.on_capture = [&] {
    const bool closing = points > 2 && rig_.changer.mounted() == devices::Target::white;
    rig_.camera.lit_dn_per_s = closing ? 0.0 : 50000.0;
  };
  EXPECT_THAT(run().warnings, Contains(HasSubstr("is the lamp on?")));
}

TEST_F(Session, WritesDownWhatTheDevicesHaveToSayAtTheEnd) {
  remarks_ = {"camera: 3 frames repeated"};
  EXPECT_TRUE(run().complete);
  const SessionReader archive(folder_);
  ASSERT_FALSE(archive.notes().empty());
  EXPECT_EQ(archive.notes().back().kind, "devices");
  EXPECT_EQ(archive.notes().back().text, "camera: 3 frames repeated");
}

TEST_F(Session, RetriesATimeoutAndWritesItDown) {
  int failures = 1;
  rig_.stages[0]->on_move = [&](FakeStage& stage) {
    if (failures-- > 0) {
      throw devices::DeviceError(devices::DeviceErrc::Timeout, stage.name(), "no answer");
    }
  };
  EXPECT_TRUE(run().complete);
  const SessionReader archive(folder_);
  std::vector<std::string> kinds;
  for (const SessionNote& note : archive.notes()) kinds.push_back(note.kind);
  EXPECT_THAT(kinds, Contains("retry"));
}

TEST_F(Session, EndsOnAFaultWithEverythingStoppedAndTheArchiveReadable) {
  int moves_left = 3;
  rig_.stages[1]->on_move = [&](FakeStage& stage) {
    if (moves_left-- == 0) {
      throw devices::DeviceError(devices::DeviceErrc::Fault, stage.name(), "alarm 7");
    }
  };
  EXPECT_THROW(run(), devices::DeviceError);
  expect_safe();
  EXPECT_FALSE(SessionReader(folder_).finished());
}

TEST_F(Session, StopsEverythingWhenAskedInTheMiddleOfAPoint) {
  std::stop_source source;
  int captures = 0;
  rig_.camera.on_capture = [&] {
    if (++captures == 40) source.request_stop();
  };
  const SessionResult result = run(source.get_token());
  EXPECT_FALSE(result.complete);
  expect_safe();
  EXPECT_EQ(captures, 40) << "nothing is exposed after the request";
  EXPECT_FALSE(SessionReader(folder_).finished());
  EXPECT_EQ(SessionReader(folder_).frames().size(), 39U)
      << "a frame under way when the shutter closed is no sample";
}

TEST_F(Session, PausesAfterThePointUnderWay) {
  run();
  int before_the_first = 0;
  const SessionReader whole(folder_);
  for (const FrameRecord& record : whole.frames()) {
    if (record.point == 0) break;
    ++before_the_first;
  }
  std::filesystem::remove_all(folder_);
  std::stop_source source;
  int captures = 0;
  rig_.camera.on_capture = [&] {
    if (++captures == before_the_first + 2) source.request_stop();  // within it
  };
  SessionPart part;
  part.pause = source.get_token();
  const SessionResult result = run({}, part);
  EXPECT_FALSE(result.finished);
  EXPECT_EQ(result.measured, 1) << "the point was finished, the next not begun";
  expect_safe();
  const SessionReader archive(folder_);
  EXPECT_FALSE(archive.finished());
  EXPECT_EQ(archive.points().size(), 1U);
  ASSERT_FALSE(archive.notes().empty());
  EXPECT_EQ(archive.notes().back().kind, "paused");
}

TEST_F(Session, LeavesOutThePointsThatAreDone) {
  SessionPart part;
  part.done[0] = PointOutcome::Measured;
  const SessionResult result = run({}, part);
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(result.measured, 2) << "with the one done before";
  ASSERT_EQ(points().size(), 1U);
  EXPECT_EQ(points().front().point, 1);
  EXPECT_THAT(frames(FrameKind::dark), testing::Not(testing::IsEmpty())) << "its own darks";
  EXPECT_THAT(frames(FrameKind::white), testing::Not(testing::IsEmpty())) << "and whites";
}

TEST_F(Session, GoesWhereItsItinerarySays) {
  directions_.clear();
  for (int i = 0; i < 11; ++i) directions_.push_back({4.0 + 3.0 * i, 20.0 + 2.0 * i, 15.0 * i});
  options_.sentinel_every = 4;
  options_.white_interval = std::chrono::seconds(6);  // points are foreseen to take one each
  const Preflight foreseen =
      preflight(rig_.devices(), rig_.known, rig_.plan(directions_), options_);
  ASSERT_TRUE(foreseen.itinerary);
  std::vector<std::pair<FrameKind, int>> wanted;
  for (const PlannedVisit& visit : foreseen.itinerary->visits) {
    if (visit.kind == VisitKind::white) wanted.push_back({FrameKind::white, -1});
    if (visit.kind == VisitKind::sentinel) wanted.push_back({FrameKind::sentinel, -1});
    if (visit.point) wanted.push_back({FrameKind::sample, static_cast<int>(*visit.point)});
  }
  EXPECT_GE(std::count(wanted.begin(), wanted.end(), std::pair{FrameKind::white, -1}), 3);
  EXPECT_GE(std::count(wanted.begin(), wanted.end(), std::pair{FrameKind::sentinel, -1}), 4);

  EXPECT_TRUE(run().complete);
  std::vector<std::pair<FrameKind, int>> done;
  const SessionReader archive(folder_);
  for (const FrameRecord& frame : archive.frames()) {
    if (frame.kind == FrameKind::dark || frame.kind == FrameKind::lamp_off) continue;
    const std::pair here{frame.kind, frame.point};
    if (done.empty() || done.back() != here) done.push_back(here);
  }
  EXPECT_EQ(done, wanted);
}

TEST_F(Session, IsNotCompleteWithAPointThatWasSaturatedBefore) {
  SessionPart part;
  part.done[0] = PointOutcome::Saturated;
  const SessionResult result = run({}, part);
  EXPECT_TRUE(result.finished);
  EXPECT_FALSE(result.complete);
}

TEST_F(Session, StopsEverythingWhenAFrameCannotBeWritten) {
  int captures = 0;
  rig_.camera.on_capture = [&] {
    if (++captures == 40) std::filesystem::remove_all(folder_ / "frames");
  };
  EXPECT_THROW(run(), FileError);
  EXPECT_EQ(captures, 40);
  expect_safe();
}

TEST_F(Session, NeitherArmsNorMovesAnythingWhenItWasAskedToStopBefore) {
  std::stop_source source;
  source.request_stop();
  EXPECT_FALSE(run(source.get_token()).complete);
  expect_safe();
  for (const auto& stage : rig_.stages) EXPECT_EQ(stage->homings, 0) << stage->name();
}

TEST_F(Session, StandsStillAfterAMoveThatNeverArrived) {
  int failures = 3;  // the first try and both retries
  rig_.stages[2]->on_move = [&](FakeStage& stage) {
    if (stage.moves >= 1 && failures-- > 0) {
      throw devices::DeviceError(devices::DeviceErrc::Timeout, stage.name(), "not in position");
    }
  };
  run();
  EXPECT_EQ(points().at(0).outcome, PointOutcome::Failed);
  EXPECT_EQ(points().at(1).outcome, PointOutcome::Measured);
  for (const auto& stage : rig_.stages) EXPECT_GE(stage->stops, 2) << "once there, once at the end";
}

TEST_F(Session, MovesNothingWhenKeepOutsBarTheWay) {
  const auto every_pose = rig_.plan(directions_).points.at(0).pose.joints;
  rig_.known.rig.keep_outs.push_back({"wall", {{0, every_pose[0] - 2_deg, every_pose[0] + 2_deg}}});
  SessionWriter archive(folder_, {}, {});
  const MeasurementPlan plan = FakeRig().plan(directions_);
  EXPECT_THROW(run_session(rig_.devices(), rig_.known, plan, options_, archive), PreflightError);
  EXPECT_EQ(moves(), 0);
}

TEST_F(Session, MovesNothingWhenAPoseIsWithinEncoderNoiseOfAKeepOut) {
  const MeasurementPlan plan = rig_.plan(directions_);
  // Beyond the pose with the smallest arm angle, so that no way leads through it.
  const Angle arm = std::min(plan.points.at(0).pose.joints[0], plan.points.at(1).pose.joints[0]);
  rig_.known.rig.keep_outs.push_back({"wall", {{0, arm - 0.4_deg, arm - 0.01_deg}}});
  const rig::TravelModel travel(rig_.known.rig);
  for (const PlannedPoint& point : plan.points) {
    EXPECT_TRUE(travel.route(rig_.known.rig.home(), point.pose.joints, Angle()))
        << "without margin";
  }
  SessionWriter archive(folder_, {}, {});
  EXPECT_THROW(run_session(rig_.devices(), rig_.known, plan, options_, archive), PreflightError);
  EXPECT_EQ(moves(), 0);
}

TEST_F(Session, MeasuresTheWhiteElsewhereWhenAKeepOutIsInItsPlace) {
  run();
  const rig::Joints usual = frames(FrameKind::white).at(0).joints;
  std::filesystem::remove_all(folder_);
  rig_.known.rig.keep_outs.push_back(
      {"post", {{0, usual[0] - 1_deg, usual[0] + 1_deg}, {2, usual[2] - 1_deg, usual[2] + 1_deg}}});
  EXPECT_TRUE(run().complete);
  EXPECT_EQ(rig::keep_out_at(rig_.known.rig, frames(FrameKind::white).at(0).joints), std::nullopt);
}

TEST_F(Session, RejectsAFrameWhoseExposureIsNotTheOneAskedFor) {
  rig_.camera.exposure_error = std::chrono::milliseconds(3);
  try {
    run();
    FAIL() << "a wrong exposure went through";
  } catch (const devices::DeviceError& error) {
    EXPECT_EQ(error.code(), devices::DeviceErrc::Protocol);
  }
  expect_safe();
  EXPECT_TRUE(SessionReader(folder_).frames().empty());
}

TEST_F(Session, RejectsAFrameOfAnotherGain) {
  rig_.camera.gain_db_of_frame = [](std::uint64_t id) { return id == 3 ? 6.0 : 0.0; };
  EXPECT_TRUE(run().complete);
  const SessionReader archive(folder_);
  const auto retry = std::find_if(archive.notes().begin(), archive.notes().end(),
                                  [](const SessionNote& note) { return note.kind == "retry"; });
  ASSERT_NE(retry, archive.notes().end());
  EXPECT_THAT(retry->text, HasSubstr("gain 6 dB"));
}

TEST_F(Session, MeasuresAPointAgainInTheEndAtWhichADeviceFailed) {
  int failures = 3;  // the first try and both retries
  rig_.stages[2]->on_move = [&](FakeStage& stage) {
    if (stage.moves >= 1 && failures-- > 0) {
      throw devices::DeviceError(devices::DeviceErrc::Timeout, stage.name(), "not in position");
    }
  };
  const SessionResult result = run();
  ASSERT_EQ(points().size(), 3U);
  EXPECT_EQ(points().back().point, 0) << "after the others";
  EXPECT_EQ(points().back().outcome, PointOutcome::Measured);
  EXPECT_TRUE(result.complete);
}

TEST_F(Session, IsNotFinishedWithAPointAtWhichADeviceFailsAgain) {
  directions_ = {{3.0, 12.0, 28.0}, {15.0, 30.0, 130.0}, {20.0, 20.0, 60.0}};
  const MeasurementPlan plan = rig_.plan(directions_);
  const Angle of_the_first = plan.points.front().pose.joints[2];
  rig_.stages[2]->moved = [&](const FakeStage&, Angle target) {
    rig_.stages[2]->reading_error = target == of_the_first ? Angle::from_degrees(0.3) : Angle();
  };
  const SessionResult result = run();
  EXPECT_FALSE(result.finished);
  EXPECT_THAT(result.failed, testing::ElementsAre(0));
  EXPECT_EQ(result.measured, 2);
  const SessionReader archive(folder_);
  EXPECT_FALSE(archive.finished());
  EXPECT_EQ(archive.notes().back().text, "points 0: to be measured again");
  expect_safe();
}

TEST_F(Session, EndsAfterFiveFailuresInARow) {
  directions_ = {{3.0, 12.0, 28.0}, {15.0, 30.0, 130.0}, {20.0, 20.0, 60.0},
                 {5.0, 20.0, 40.0}, {10.0, 25.0, 90.0},  {8.0, 40.0, 100.0}};
  rig_.camera.on_capture = [&] {
    if (!rig_.light.lit.empty() && rig_.changer.mounted() == devices::Target::sample) {
      throw devices::DeviceError(devices::DeviceErrc::Timeout, "camera", "no frame");
    }
  };
  EXPECT_THROW(run(), devices::DeviceError);
  EXPECT_EQ(SessionReader(folder_).points().size(), 5U);
  expect_safe();
}

TEST_F(Session, HomesAnewAndMeasuresAgainWhatADeviceInterruptedThatDroppedOff) {
  bool lost = false;
  rig_.camera.on_capture = [&] {
    if (lost || rig_.light.lit != "G" || rig_.changer.mounted() != devices::Target::sample) return;
    lost = true;
    throw devices::DeviceError(devices::DeviceErrc::Disconnected, "camera", "unplugged");
  };
  EXPECT_TRUE(run().complete);
  for (const auto& stage : rig_.stages) EXPECT_EQ(stage->homings, 2) << stage->name();
  const SessionReader archive(folder_);
  EXPECT_EQ(archive.points().size(), 3U) << "one row more, of the attempt that failed";
  EXPECT_THAT(archive.notes(), Contains(testing::Field(&SessionNote::kind, kCameBackNote)));
}

TEST_F(Session, EndsWhenADeviceDoesNotComeBack) {
  int moves = 0;
  rig_.stages[1]->on_move = [&](FakeStage&) { ++moves; };
  rig_.stages[1]->on_home = [&](FakeStage& stage) {
    if (moves > 0) {
      throw devices::DeviceError(devices::DeviceErrc::Disconnected, stage.name(),
                                 "still unplugged");
    }
  };
  rig_.camera.on_capture = [&] {
    if (moves > 3) {
      throw devices::DeviceError(devices::DeviceErrc::Disconnected, "camera", "unplugged");
    }
  };
  const auto before = rig_.clock.now();
  EXPECT_THROW(run(), devices::DeviceError);
  EXPECT_GT(rig_.clock.now() - before, kMayBeAway);
  expect_safe();
  EXPECT_FALSE(SessionReader(folder_).finished());
}

TEST_F(Session, EndsWhenADarkFrameIsBright) {
  rig_.camera.bright_behind_the_shutter = true;
  try {
    run();
    FAIL() << "took a bright frame for a dark one";
  } catch (const devices::DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("is the shutter closed?"));
  }
  expect_safe();
}

TEST_F(Session, RejectsAFrameThatComesTwice) {
  rig_.camera.repeat_frame_id = true;
  EXPECT_THROW(run(), devices::DeviceError);
  EXPECT_EQ(SessionReader(folder_).frames().size(), 1U) << "the first one was good";
}

TEST_F(Session, MovesNothingWhenADirectionCannotBeReached) {
  directions_.push_back({2.84, 89.0, 15.0});
  EXPECT_THAT(refusal(), HasSubstr("BELOW_HORIZON"));
  EXPECT_EQ(moves(), 0);
}

TEST_F(Session, MovesNothingWhenADirectionStandsTwice) {
  directions_.push_back(directions_.front());
  EXPECT_THAT(refusal(), HasSubstr("twice"));
  EXPECT_EQ(moves(), 0);
}

TEST_F(Session, MovesNothingWhenTheStagesAreSwapped) {
  std::swap(rig_.stages[0], rig_.stages[1]);
  EXPECT_THAT(refusal(), HasSubstr("stands where the rig has axis"));
  EXPECT_EQ(moves(), 0);
}

TEST_F(Session, MovesNothingWhenTheCalibrationIsOfAnotherCamera) {
  rig_.known.camera.width_px = 64;
  EXPECT_THAT(refusal(), HasSubstr("the calibration is for 64 x 32 px"));
  EXPECT_EQ(moves(), 0);
}

TEST_F(Session, NamesTheOptionThatIsOutOfRange) {
  options_.bracket_ratio = 0.5;
  EXPECT_THAT(refusal(), HasSubstr("bracket_ratio is 0.5"));
}

}  // namespace
}  // namespace gonio::acquisition
