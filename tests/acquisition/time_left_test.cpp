#include "gonio/acquisition/time_left.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <map>

#include "fake_rig.h"
#include "gonio/acquisition/preflight.h"
#include "gonio/acquisition/resume.h"
#include "temporary_folder.h"

namespace gonio::acquisition {
namespace {

PlannedVisit visit(VisitKind kind, double travel_s, double dwell_s,
                   std::optional<std::size_t> point = {}) {
  return {kind, point, {}, {}, travel_s, dwell_s};
}

/// Three points of 10, 20 and 30 s, a check and a white before the last.
class TimeLeftTest : public testing::Test {
 protected:
  static Itinerary itinerary() {
    Itinerary itinerary;
    itinerary.visits = {
        visit(VisitKind::home, 0.0, 7.0),      visit(VisitKind::dark, 0.0, 2.0),
        visit(VisitKind::white, 3.0, 40.0),    visit(VisitKind::point, 4.0, 6.0, 0),
        visit(VisitKind::point, 5.0, 15.0, 1), visit(VisitKind::home, 4.0, 8.0),
        visit(VisitKind::white, 3.0, 50.0),    visit(VisitKind::point, 2.0, 28.0, 2),
        visit(VisitKind::home, 2.0, 5.0),      visit(VisitKind::white, 3.0, 41.0),
        visit(VisitKind::park, 6.0, 0.0)};
    return itinerary;
  }
  static MeasurementPlan plan() {
    MeasurementPlan plan;
    plan.points.resize(3);
    return plan;
  }

  static constexpr double kOpening_s = 7.0 + 2.0 + 43.0;
  static constexpr double kPoints_s = 60.0;
  static constexpr double kBetween_s = 12.0 + 53.0;
  static constexpr double kClosing_s = 7.0 + 44.0 + 6.0;

  TimeLeft left_{itinerary(), plan()};
};

TEST_F(TimeLeftTest, AtTheBeginningIsTheWholeForecast) {
  EXPECT_DOUBLE_EQ(left_.from("home", {0, 1, 2}), kOpening_s + kPoints_s + kBetween_s + kClosing_s);
  EXPECT_DOUBLE_EQ(left_.from("white", {0, 1, 2}), 43.0 + kPoints_s + kBetween_s + kClosing_s);
}

TEST_F(TimeLeftTest, WhatIsDoneIsNotCounted) {
  EXPECT_DOUBLE_EQ(left_.from("point", {0, 1, 2}), kPoints_s + kBetween_s + kClosing_s);
  left_.took(0, 10.0);
  EXPECT_DOUBLE_EQ(left_.from("point", {1, 2}), 50.0 + kBetween_s + kClosing_s);
  EXPECT_DOUBLE_EQ(left_.from("white", {2}), 30.0 + kBetween_s + kClosing_s) << "in between";
  left_.comes_to(2);
  EXPECT_DOUBLE_EQ(left_.from("point", {2}), 30.0 + kClosing_s) << "its check and white are done";
  EXPECT_DOUBLE_EQ(left_.from("closing white", {}), 44.0 + 6.0);
  EXPECT_DOUBLE_EQ(left_.from("park", {}), 6.0);
}

TEST_F(TimeLeftTest, APartWithoutPointsHasNoCheck) {
  EXPECT_DOUBLE_EQ(left_.from("home", {}), kOpening_s + kClosing_s - 7.0);
}

TEST_F(TimeLeftTest, PointsThatTookLongerMakeTheOthersLonger) {
  left_.took(0, 10.0 + 70.0);  // 70 s for (10 + 3 * 20) s foreseen
  EXPECT_DOUBLE_EQ(left_.from("point", {1, 2}), 2.0 * 50.0 + kBetween_s + kClosing_s);
}

TEST_F(TimeLeftTest, APointThatWasAddedTakesWhatOthersDo) {
  EXPECT_DOUBLE_EQ(left_.from("point", {7}), 20.0 + kClosing_s);
}

/// A session that is stopped within its third point and resumed.
class SecondsLeft : public testing::Test {
 protected:
  /// Calls `look` with what the session says and what its journal does, as each phase begins.
  void run(SessionWriter archive, const SessionPart& part,
           const std::function<void(const SessionProgress&, double)>& look,
           std::stop_token stop = {}) {
    const auto progress = [&](const SessionProgress& now) {
      look(now, seconds_left(SessionReader(folder_), itinerary(), plan_));
    };
    run_session(rig_.devices(), rig_.known, plan_, options_, archive, progress, std::move(stop),
                part);
  }
  Itinerary itinerary() { return checked_itinerary(rig_.devices(), rig_.known, plan_, options_); }

  const TemporaryFolder parent_;
  const std::filesystem::path folder_ = parent_.path() / "session";
  FakeRig rig_;
  SessionOptions options_;
  MeasurementPlan plan_ =
      rig_.plan({{3.0, 12.0, 28.0}, {15.0, 30.0, 130.0}, {20.0, 20.0, 60.0}, {2.0, 60.0, 180.0}});
};

TEST_F(SecondsLeft, IsWhatTheSessionItselfSays) {
  std::stop_source stop;
  int looks = 0;
  const auto compare = [&](const SessionProgress& now, double left) {
    if (now.phase != "point" && now.phase != "home") return;
    ++looks;
    EXPECT_NEAR(left, now.remaining_s, 1e-6) << now.phase << ", " << now.done << " done";
  };
  run(
      SessionWriter(folder_, {}, {}), {},
      [&](const SessionProgress& now, double left) {
        compare(now, left);
        if (now.phase == "point" && now.done == 2) stop.request_stop();
      },
      stop.get_token());
  EXPECT_EQ(looks, 4);

  looks = 0;
  const ResumeState state = resume_state(SessionReader(folder_));
  files::ProcessLock lock(session_lock(folder_));
  const auto begins_at = state.may_begin_at + std::chrono::hours(1);
  run(SessionWriter::resume(folder_, std::move(lock), begins_at, rig_.clock.now(), ""),
      part_to_resume(state), compare);
  EXPECT_EQ(looks, 3);
  EXPECT_EQ(seconds_left(SessionReader(folder_), itinerary(), plan_), 0.0);
}

TEST_F(SecondsLeft, LagsBehindTheSessionByNoMoreThanItsPhase) {
  options_.sentinel_every = 2;
  double before = std::numeric_limits<double>::infinity();
  std::map<std::string, int> phases;
  run(SessionWriter(folder_, {}, {}), {}, [&](const SessionProgress& now, double left) {
    SCOPED_TRACE(now.phase + ", " + std::to_string(now.done) + " done");
    ++phases[now.phase];
    EXPECT_LE(left, before + 1e-6);
    if (now.phase == "point" || now.phase == "park") {
      EXPECT_NEAR(left, now.remaining_s, 1e-6) << "what was before is behind";
    } else {
      EXPECT_GE(left, now.remaining_s - 1e-6);
    }
    before = now.remaining_s;
  });
  for (const char* phase : {"dark", "white", "check", "closing white", "park"}) {
    EXPECT_TRUE(phases.contains(phase)) << phase;
  }
  EXPECT_EQ(phases["point"], 4);
}

TEST_F(SecondsLeft, ToldAlsoWhereAllFramesAreLost) {
  std::stop_source stop;
  run(
      SessionWriter(folder_, {}, {}), {},
      [&](const SessionProgress& now, double) {
        if (now.phase == "point" && now.done == 2) stop.request_stop();
      },
      stop.get_token());
  std::filesystem::remove_all(folder_ / "frames");
  std::filesystem::create_directory(folder_ / "frames");
  EXPECT_GT(seconds_left(SessionReader(folder_), itinerary(), plan_), 0.0);
}

TEST_F(SecondsLeft, PointsThatDoNotCountAreTakenAgainAfterEnough) {
  SessionPart part;
  part.done = {{0, PointOutcome::Measured}};
  part.dropped = {3};
  part.enough = true;
  EXPECT_THAT(points_left(part, 4), testing::ElementsAre(1, 2));
}

}  // namespace
}  // namespace gonio::acquisition
