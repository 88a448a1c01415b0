// A rig that changes while nobody looks: axes that slip, a lamp that steps, drifts, flickers or
// goes off. None of it may leave data that looks good.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "gonio/acquisition/trust_notes.h"
#include "steady_session.h"

namespace gonio {
namespace {

using acquisition::Reduction;
using acquisition::SessionReader;
using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using namespace gonio::literals;

constexpr Angle kRefused = 0.05_deg;
constexpr Angle kReported = 0.02_deg;

// Light of the room, W/m2/sr; a white under the lamp has about 1.3.
constexpr double kRoomLight = 0.01;
constexpr double kHarmlessLight = 0.0003;    // 24 DN/s; the dimmest sample has thousands
constexpr double kAsDarkCurrent = 0.000025;  // 5 e/s

class Trust : public SteadySession {
 protected:
  Trust() {
    options_.sentinel_every = 4;
    options_.white_frames = 4;
  }

  void SetUp() override {
    begin(whole_);
    wanted_ = samples_of(whole_);
  }

  /// Middle of the time between the ends of two points of the untroubled session that follow one
  /// another without a check between.
  std::chrono::nanoseconds between(int point, int next) const {
    return between(point, next, whole_);
  }
  static std::chrono::nanoseconds between(int point, int next,
                                          const std::filesystem::path& folder) {
    const SessionReader archive(folder);
    return (archive.points().at(static_cast<std::size_t>(point)).finished_at +
            archive.points().at(static_cast<std::size_t>(next)).finished_at) /
           2;
  }

  /// A session without sentinels takes less time.
  std::filesystem::path untroubled_without_sentinels() {
    options_.sentinel_every = 0;
    const std::filesystem::path folder = folder_.path() / "without";
    begin(folder);
    return folder;
  }

  std::vector<std::string> notes(const std::string& kind) const { return notes_of(session_, kind); }

  /// How often each point was acknowledged.
  std::vector<int> times_taken() const {
    const SessionReader archive(session_);
    std::vector<int> times(plan_.points.size(), 0);
    for (const acquisition::PointRecord& point : archive.points()) {
      ++times.at(static_cast<std::size_t>(point.point));
    }
    return times;
  }

  /// Of the untroubled session: when the second half of these frames begins, a lamp-off frame last.
  std::chrono::nanoseconds amid_frames(
      const std::function<bool(const acquisition::FrameRecord&)>& belongs) const {
    const SessionReader archive(whole_);
    std::vector<std::chrono::nanoseconds> starts;
    for (const acquisition::FrameRecord& frame : archive.frames()) {
      if (belongs(frame)) starts.push_back(frame.exposure_start);
    }
    EXPECT_GE(starts.size(), 4U);
    return starts.at(starts.size() / 2);
  }

  static int suspect_samples(const Reduction& found) {
    return static_cast<int>(std::count_if(
        found.samples.samples.begin(), found.samples.samples.end(),
        [](const auto& sample) { return sample.flags.find("suspect") != std::string::npos; }));
  }

  TemporaryFolder folder_;
  std::filesystem::path whole_ = folder_.path() / "whole";
  std::filesystem::path session_ = folder_.path() / "session";
  std::string wanted_;
};

TEST_F(Trust, AnUntroubledSessionSuspectsNothing) {
  session_ = whole_;
  EXPECT_THAT(notes(acquisition::kSuspectNote), IsEmpty());
  EXPECT_EQ(notes(acquisition::kSentinelNote).size(), 4U) << "at the start and every four points";
  EXPECT_THAT(notes(acquisition::kHomeDeltaNote), testing::SizeIs(3));
  EXPECT_THAT(times_taken(), testing::Each(1));
}

TEST_F(Trust, AnUntroubledOutageIsCompared) {
  interrupt_and_resume(session_);
  EXPECT_THAT(notes(acquisition::kHomeDeltaNote),
              Contains(AllOf(HasSubstr("over the interruption"), HasSubstr("+0.0000 deg"),
                             Not(HasSubstr("more than")))));
  EXPECT_THAT(notes(acquisition::kSuspectNote), IsEmpty());
  EXPECT_EQ(samples_of(session_), wanted_);
}

TEST_F(Trust, ASlipDuringAnOutageIsHomedAwayAndWhatItMayHaveSpoiltTakenAgain) {
  turned_meanwhile_ = kRefused;
  interrupt_and_resume(session_);
  // After four points there was a check: only what came after it may have seen the slip.
  EXPECT_THAT(
      notes(acquisition::kSuspectNote),
      testing::ElementsAre(AllOf(testing::StartsWith("points 4 5: "), HasSubstr("+0.0500 deg"))));
  EXPECT_THAT(times_taken(), testing::ElementsAre(1, 1, 1, 1, 2, 2, 1, 1, 1, 1, 1, 1));
  EXPECT_EQ(samples_of(session_), wanted_);
}

TEST_F(Trust, ASmallSlipDuringAnOutageIsReported) {
  turned_meanwhile_ = kReported;
  interrupt_and_resume(session_);
  EXPECT_THAT(notes(acquisition::kHomeDeltaNote),
              Contains(AllOf(HasSubstr("+0.0200 deg"), HasSubstr("more than the usual"))));
  EXPECT_THAT(notes(acquisition::kSuspectNote), IsEmpty());
  EXPECT_EQ(samples_of(session_), wanted_);
}

TEST_F(Trust, AnAxisThatWasOnItsWayTellsNothing) {
  turned_meanwhile_ = 5.0_deg;
  interrupt_and_resume(session_);
  EXPECT_THAT(notes(acquisition::kHomeDeltaNote), Contains(HasSubstr("was on its way")));
  EXPECT_THAT(notes(acquisition::kSuspectNote), IsEmpty());
}

TEST_F(Trust, AnAxisThatSlipsInTheCourseIsFoundAtTheNextCheck) {
  world_.axes[kTurnedAxis].slip = kRefused;
  world_.axes[kTurnedAxis].slips_at = between(5, 6);
  EXPECT_TRUE(begin(session_).complete);
  EXPECT_THAT(notes(acquisition::kSuspectNote),
              testing::ElementsAre(testing::StartsWith("points 4 5 6 7: ")));
  EXPECT_THAT(times_taken(), testing::ElementsAre(1, 1, 1, 1, 2, 2, 2, 2, 1, 1, 1, 1));
  EXPECT_EQ(samples_of(session_), wanted_);
}

TEST_F(Trust, WithoutSentinelsTheHomingAtTheEndFindsIt) {
  const auto slips_at = between(5, 6, untroubled_without_sentinels());
  world_.axes[kTurnedAxis].slip = -kRefused;
  world_.axes[kTurnedAxis].slips_at = slips_at;
  EXPECT_TRUE(begin(session_).complete);
  EXPECT_THAT(notes(acquisition::kSentinelNote), IsEmpty());
  EXPECT_THAT(times_taken(), testing::Each(2));
  EXPECT_EQ(samples_of(session_), wanted_);
}

TEST_F(Trust, ASmallSlipInTheCourseIsReported) {
  world_.axes[kTurnedAxis].slip = kReported;
  world_.axes[kTurnedAxis].slips_at = between(5, 6);
  EXPECT_TRUE(begin(session_).complete);
  EXPECT_THAT(notes(acquisition::kHomeDeltaNote),
              Contains(AllOf(HasSubstr("+0.0200 deg"), HasSubstr("more than the usual"))));
  EXPECT_THAT(times_taken(), testing::Each(1));
}

TEST_F(Trust, AStepOfTheLightIsFoundAndWhatItSpoiltTakenAgain) {
  world_.lamp.events = {{between(5, 6), {}, 1.03, false}};
  EXPECT_TRUE(begin(session_).complete);
  EXPECT_THAT(notes(acquisition::kSuspectNote),
              testing::ElementsAre(AllOf(testing::StartsWith("points 4 5 6 7: "),
                                         HasSubstr("sentinel changed by +"))));
  const Reduction found = reduced(session_);
  const double worst = worst_deviation(found, whole_);
  RecordProperty("worst_deviation", std::to_string(worst));
  std::printf("3 %% step: worst deviation %.3f %%\n", 100.0 * worst);
  EXPECT_LT(worst, 0.005);
  EXPECT_EQ(suspect_samples(found), 0);
}

TEST_F(Trust, AnEvenDriftLeavesLittle) {
  const auto end = SessionReader(whole_).points().back().finished_at;
  for (const bool seen : {false, true}) {
    for (const int every : {0, 4}) {
      SCOPED_TRACE(testing::Message() << "seen " << seen << ", sentinel every " << every);
      options_.sentinel_every = every;
      session_ = folder_.path() / (std::to_string(every) + (seen ? "seen" : "unseen"));
      world_.lamp.events = {{std::chrono::seconds(0), 2 * end, 1.10, seen}};
      EXPECT_TRUE(begin(session_).complete);
      const double worst = worst_deviation(reduced(session_), whole_);
      std::printf("5 %% drift, %s, sentinel every %d: worst deviation %.3f %%\n",
                  seen ? "seen by the monitor" : "unseen", every, 100.0 * worst);
      EXPECT_LT(worst, 0.003);
    }
  }
}

TEST_F(Trust, WhitesInBetweenFollowALampThatComesBack) {
  options_.sentinel_every = 0;
  const std::filesystem::path whole = untroubled_without_sentinels();
  const auto end = SessionReader(whole).points().back().finished_at;
  const auto half = end / 2;
  // The monitor sees none of it, and opening and closing white are alike.
  world_.lamp.events = {{std::chrono::seconds(0), half, 1.05, false},
                        {half, half, 1.0 / 1.05, false}};
  plan_.duration_s = devices::to_seconds(end);
  std::map<bool, double> worst;
  for (const bool between : {false, true}) {
    session_ = folder_.path() / (between ? "with" : "few");
    options_.white_interval = between ? end / 6 : std::chrono::nanoseconds(0);
    EXPECT_TRUE(begin(session_).complete);
    worst[between] = worst_deviation(reduced(session_), whole);
    std::printf("lamp up 5 %% and back, whites %s: worst deviation %.3f %%\n",
                between ? "between" : "at the ends", 100.0 * worst[between]);
  }
  EXPECT_GT(worst[false], 0.015);
  EXPECT_LT(worst[true], 0.004);
}

TEST_F(Trust, ALampThatGoesOffEndsTheSessionWithoutAGoodPointInTheDark) {
  const sim::SimOptions steady = world_;
  const auto off = between(5, 6);
  world_.lamp.events = {{off, {}, 0.0, true}};
  try {
    begin(session_);
    FAIL() << "went on in the dark";
  } catch (const devices::DeviceError& error) {
    EXPECT_EQ(error.code(), devices::DeviceErrc::Fault);
    EXPECT_THAT(error.what(), HasSubstr("is the lamp on?"));
  }
  {
    const SessionReader archive(session_);
    for (const acquisition::PointRecord& point : archive.points()) {
      EXPECT_LT(point.finished_at, off);
    }
    EXPECT_EQ(archive.points().size(), 6U);
    EXPECT_THAT(notes("device error"), Contains(HasSubstr("is the lamp on?")));
  }
  world_ = steady;
  EXPECT_TRUE(resume(session_).complete);
  EXPECT_EQ(samples_of(session_), wanted_);
}

TEST_F(Trust, WhatFlickersWheneverItIsTakenIsMarked) {
  // 20 % up and down, all the time; no multiple of what a frame takes (10 ms and its exposure).
  const std::filesystem::path untroubled = untroubled_without_sentinels();
  const auto end = 4 * SessionReader(untroubled).points().back().finished_at;
  const auto begin_at = between(5, 6, untroubled);
  constexpr auto kHalfPeriod = std::chrono::microseconds(3700);
  bool up = true;
  for (auto at = begin_at; at < end; at += kHalfPeriod, up = !up) {
    world_.lamp.events.push_back({at, {}, up ? 1.2 : 1.0 / 1.2, true});
  }
  try {
    begin(session_);
    FAIL() << "took its closing white from a lamp that flickers";
  } catch (const devices::DeviceError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no steady light at the white"));
  }
  EXPECT_THAT(notes(acquisition::kSuspectNote), Contains(HasSubstr("lamp monitor read")));
  const std::vector<int> times = times_taken();
  EXPECT_LE(*std::max_element(times.begin(), times.end()), 2) << "not for ever";
  const Reduction found = reduced(session_);
  EXPECT_GT(suspect_samples(found), 0);
  EXPECT_THAT(found.warnings, Contains(HasSubstr("suspect: the lamp monitor read")));
  for (const samples::Sample& sample : found.samples.samples) {
    if (sample.pose < 6) {
      EXPECT_THAT(sample.flags, Not(HasSubstr("suspect")));
    }
  }
}

TEST_F(Trust, RoomLightThatGoesOnAtAPointIsFoundAndThePointTakenAgain) {
  constexpr int kPoint = 5;
  world_.scene.ambient_steps = {
      {amid_frames([](const acquisition::FrameRecord& frame) { return frame.point == kPoint; }),
       kRoomLight}};
  EXPECT_TRUE(begin(session_).complete);
  EXPECT_THAT(notes(acquisition::kSuspectNote),
              testing::ElementsAre(AllOf(testing::StartsWith("points 5: "),
                                         HasSubstr("did the light of the room change?"))));
  EXPECT_THAT(times_taken(), testing::ElementsAre(1, 1, 1, 1, 1, 2, 1, 1, 1, 1, 1, 1));
  const Reduction found = reduced(session_);
  EXPECT_EQ(suspect_samples(found), 0);
  const Reduction whole = reduced(whole_);
  ASSERT_EQ(found.samples.samples.size(), whole.samples.samples.size());
  double largest = 0.0;
  for (std::size_t i = 0; i < whole.samples.samples.size(); ++i) {
    const samples::Sample& a = found.samples.samples[i];
    const samples::Sample& b = whole.samples.samples[i];
    const brdf::Rgb u = (a.sigma_per_sr.square() + b.sigma_per_sr.square()).sqrt();
    largest = std::max(largest, ((a.value_per_sr - b.value_per_sr).abs() / u).maxCoeff());
  }
  const double worst = worst_deviation(found, whole_);
  std::printf("room light at a point: worst deviation %.3f %% of a pose, %.1f sigma of a sample\n",
              100.0 * worst, largest);
  EXPECT_LT(worst, 0.01);
  EXPECT_LT(largest, 5.0);
}

TEST_F(Trust, AWhiteAtWhichRoomLightGoesOnIsTakenAgain) {
  const auto closing = SessionReader(whole_).points().back().finished_at;
  world_.scene.ambient_steps = {{amid_frames([closing](const acquisition::FrameRecord& frame) {
                                   return frame.point < 0 && frame.exposure_start > closing &&
                                          frame.kind != acquisition::FrameKind::sentinel;
                                 }),
                                 10.0 * kRoomLight}};
  EXPECT_TRUE(begin(session_).complete);
  EXPECT_THAT(notes(acquisition::kWhiteAgainNote),
              testing::ElementsAre(HasSubstr("did the light of the room change?")));
  EXPECT_LT(worst_deviation(reduced(session_), whole_), 0.002);
}

TEST_F(Trust, RoomLightThatDoesNotMatterCostsNothing) {
  // A room that is lit, and noise; then a level that comes and goes by as much as dark current is;
  // then a step that is seen, but below what the samples were to be precise to.
  const auto end = SessionReader(whole_).points().back().finished_at;
  std::vector<sim::AmbientStep> flickers;
  for (auto at = std::chrono::nanoseconds(0); at < end; at += std::chrono::milliseconds(730)) {
    flickers.push_back({at, flickers.size() % 2 == 0 ? kAsDarkCurrent : 0.0});
  }
  const std::vector<std::vector<sim::AmbientStep>> rooms{
      {{std::chrono::nanoseconds(0), kRoomLight}}, flickers, {{between(5, 6), kHarmlessLight}}};
  world_.same_noise_again = false;
  for (std::size_t room = 0; room < rooms.size(); ++room) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      SCOPED_TRACE(testing::Message() << "room " << room << ", seed " << seed);
      world_.scene.ambient_steps = rooms[room];
      world_.noise_seed = seed;
      session_ = folder_.path() / (std::to_string(room) + "-" + std::to_string(seed));
      EXPECT_TRUE(begin(session_).complete);
      EXPECT_THAT(notes(acquisition::kSuspectNote), IsEmpty());
      EXPECT_THAT(notes(acquisition::kWhiteAgainNote), IsEmpty());
      EXPECT_THAT(times_taken(), testing::Each(1));
    }
  }
}

TEST_F(Trust, SuspectsThatWereNotTakenAgainAreStillToBeDone) {
  std::stop_source pause;
  {
    sim::SimOptions slipping = world_;
    slipping.axes[kTurnedAxis].slip = kRefused;
    slipping.axes[kTurnedAxis].slips_at = between(5, 6);
    sim::SimGoniometer world(slipping);
    acquisition::SessionWriter archive(session_, {}, {});
    acquisition::SessionPart part;
    part.pause = pause.get_token();
    int checks = 0;
    run(
        world, archive,
        [&](const acquisition::SessionProgress& now) {
          checks += now.phase == "check" ? 1 : 0;
          if (checks == 2) pause.request_stop();
        },
        part);
  }
  EXPECT_EQ(suspect_samples(reduced(session_)), 4 * reduction_.grid * reduction_.grid);
  const acquisition::ResumeState state = acquisition::resume_state(SessionReader(session_));
  EXPECT_THAT(state.again,
              testing::ElementsAre(HasSubstr("point 4 is suspect"), HasSubstr("point 5"),
                                   HasSubstr("point 6"), HasSubstr("point 7")));
  EXPECT_TRUE(resume(session_).complete);
  EXPECT_EQ(samples_of(session_), wanted_);
}

}  // namespace
}  // namespace gonio
