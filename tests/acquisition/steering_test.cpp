#include "gonio/acquisition/steering.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "fake_rig.h"
#include "gonio/acquisition/resume.h"
#include "gonio/errors/errors.h"
#include "temporary_folder.h"

namespace gonio::acquisition {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;
using testing::ThrowsMessage;
using namespace gonio::literals;

const std::vector<std::array<double, 3>> kThree{
    {3.0, 12.0, 28.0}, {15.0, 30.0, 130.0}, {20.0, 20.0, 60.0}};
const std::vector<std::array<double, 3>> kMore{{10.0, 15.0, 40.0}, {12.0, 25.0, 90.0}};

/// Answers as a test says.
class Script final : public Steering {
 public:
  std::function<std::optional<Decision>(const SessionSoFar&)> answer;
  std::optional<Decision> decide(const SessionSoFar& now) override {
    lefts.push_back(now.left);
    return answer(now);
  }
  std::vector<std::vector<int>> lefts;
};

class SteeredSession : public testing::Test {
 protected:
  SessionResult run(const SessionPart& part = {}) {
    SessionWriter archive(folder_, {}, {});
    return run_session(rig_.devices(), rig_.known, plan_, options_, archive, {}, {}, part,
                       &steering_);
  }
  /// Pose number `i` of kMore, behind the plan.
  AddedPoint more(std::size_t i, const MeasurementPlan& plan) const {
    const PlannedPoint point = rig_.plan({kMore[i]}).points.at(0);
    return {static_cast<int>(plan.points.size()), std::nullopt, std::nullopt, point.direction,
            point.pose};
  }
  /// For points that failed and have no stand-in yet.
  std::optional<Decision> replacement(const SessionSoFar& now) {
    for (const auto& [point, outcome] : now.done) {
      if (outcome == PointOutcome::Measured || replaced_.contains(point)) continue;
      replaced_.insert(point);
      AddedPoint added = more(0, now.plan);
      added.replaces = point;
      return Decision{Decision::Kind::add, "failed", {added}, {}, {}};
    }
    return std::nullopt;
  }
  std::vector<int> measured() const { return measured(folder_); }
  static std::vector<int> measured(const std::filesystem::path& folder) {
    std::vector<int> points;
    const SessionReader archive(folder);
    for (const PointRecord& record : archive.points()) {
      if (record.outcome == PointOutcome::Measured) points.push_back(record.point);
    }
    return points;
  }
  /// Every reading of the first axis fails while point 1 is gone to.
  void fail_point_1() {
    rig_.stages[0]->moved = [this](const FakeStage&, Angle target) {
      const bool its_own = target == plan_.points[1].pose.joints[0];
      rig_.stages[0]->failing_readings = its_own ? 1 + options_.retries : 0;
    };
  }

  TemporaryFolder temporary_;
  std::filesystem::path folder_ = temporary_.path() / "session";
  FakeRig rig_;
  SessionOptions options_;
  MeasurementPlan plan_ = rig_.plan(kThree);
  Script steering_;
  std::set<int> replaced_;
};

TEST_F(SteeredSession, IsAskedAtTheBeginningAndAfterEachPoint) {
  steering_.answer = [](const SessionSoFar&) { return std::nullopt; };
  EXPECT_TRUE(run().complete);
  EXPECT_THAT(steering_.lefts,
              ElementsAre(ElementsAre(0, 1, 2), ElementsAre(1, 2), ElementsAre(2), IsEmpty()));
}

TEST_F(SteeredSession, MeasuresPointsThatAreAddedBehindThePlan) {
  steering_.answer = [&](const SessionSoFar& now) -> std::optional<Decision> {
    const std::size_t added = now.plan.points.size() - 3;
    if (!now.left.empty() || added == 2) return std::nullopt;
    return Decision{Decision::Kind::add, "more", {more(added, now.plan)}, {}, {}};
  };
  const SessionResult result = run();
  EXPECT_TRUE(result.complete);
  EXPECT_EQ(result.planned, 5);
  EXPECT_THAT(measured(), ElementsAre(0, 1, 2, 3, 4));
  const SessionReader archive(folder_);
  const std::vector<LoggedDecision> log = decisions(archive);
  ASSERT_THAT(log, SizeIs(2));
  // Noted before anything moved for it.
  for (const FrameRecord& frame : archive.frames()) {
    if (frame.point == 3) {
      EXPECT_GE(frame.exposure_start, log[0].at);
    } else if (frame.point == 4) {
      EXPECT_GE(frame.exposure_start, log[1].at);
    }
  }
}

TEST_F(SteeredSession, LeavesOutWhatIsLeftWhenItIsEnough) {
  steering_.answer = [](const SessionSoFar& now) -> std::optional<Decision> {
    if (now.done.empty()) return std::nullopt;
    return Decision{Decision::Kind::enough, "enough", {}, now.left, {}};
  };
  const SessionResult result = run();
  EXPECT_TRUE(result.finished);
  EXPECT_TRUE(result.complete) << "what was dropped is not missing";
  EXPECT_EQ(result.planned, 1);
  EXPECT_THAT(measured(), ElementsAre(0));
  EXPECT_THAT(steering_.lefts, SizeIs(2)) << "nobody is asked any more";
}

TEST_F(SteeredSession, IsCompleteWithAReplacementForAPointThatFailed) {
  fail_point_1();
  steering_.answer = [&](const SessionSoFar& now) { return replacement(now); };
  const SessionResult result = run();
  EXPECT_THAT(measured(), ElementsAre(0, 2, 3));
  EXPECT_TRUE(result.complete);
}

TEST_F(SteeredSession, IsIncompleteWithoutOne) {
  fail_point_1();
  steering_.answer = [](const SessionSoFar&) { return std::nullopt; };
  const SessionResult result = run();
  EXPECT_THAT(result.failed, ElementsAre(1)) << "left to a resumption";
  EXPECT_FALSE(result.finished);
  EXPECT_FALSE(result.complete);
}

TEST_F(SteeredSession, TellsWhyAPoseCannotBeAndMovesNothingForOneThatIsDecidedAllTheSame) {
  std::vector<std::string> refusals;
  int moves = 0;
  steering_.answer = [&](const SessionSoFar& now) -> std::optional<Decision> {
    AddedPoint added = more(0, now.plan);
    const auto refused = [&](const AddedPoint& point) {
      refusals.push_back(now.refusal({point.direction, point.pose, 0.0, 0.0}));
    };
    refused(added);
    added.direction = plan_.points[0].direction;
    refused(added);
    added = more(0, now.plan);
    added.pose.joints[1] = 1000.0_deg;
    refused(added);
    added.pose.joints.pop_back();
    refused(added);
    for (const auto& stage : rig_.stages) moves += stage->moves;
    return Decision{Decision::Kind::add, "", {added}, {}, {}};
  };
  EXPECT_THAT([&] { run(); }, ThrowsMessage<std::logic_error>(HasSubstr("joints")));
  ASSERT_THAT(refusals, SizeIs(4));
  EXPECT_EQ(refusals[0], "");
  EXPECT_THAT(refusals[1], HasSubstr("twice"));
  EXPECT_THAT(refusals[2], HasSubstr("limits"));
  EXPECT_THAT(refusals[3], HasSubstr("joints"));
  int moves_after = 0;
  for (const auto& stage : rig_.stages) {
    moves_after += stage->moves;
    EXPECT_TRUE(stage->stopped);
  }
  EXPECT_EQ(moves_after, moves);
  EXPECT_THAT(decisions(SessionReader(folder_)), IsEmpty());
}

TEST_F(SteeredSession, TakesNoDecisionFromAFolderThatWasMovedOrReplacedMeanwhile) {
  const std::filesystem::path away = temporary_.path() / "away";
  const auto enough = [](const SessionSoFar& now) {
    return Decision{Decision::Kind::enough, "enough", {}, now.left, {}};
  };
  const auto unreadable = [&](const SessionSoFar&) -> Decision {
    throw FileError(folder_, "open", "there is no session journal");
  };
  const auto another = [&](const SessionSoFar& now) {
    SessionWriter(folder_, {}, {});
    return enough(now);
  };
  const std::vector<std::function<Decision(const SessionSoFar&)>> answers{enough, unreadable,
                                                                          another};
  for (const auto& answer : answers) {
    SCOPED_TRACE(&answer - answers.data());
    steering_.answer = [&](const SessionSoFar& now) -> std::optional<Decision> {
      if (now.done.empty()) return std::nullopt;
      std::filesystem::rename(folder_, away);
      return answer(now);
    };
    EXPECT_THROW(run(), FolderMoved);
    EXPECT_THAT(measured(away), ElementsAre(0));
    EXPECT_THAT(decisions(SessionReader(away)), IsEmpty());
    std::filesystem::remove_all(away);
    std::filesystem::remove_all(folder_);
  }
}

TEST_F(SteeredSession, EndsByWhatItsSteeringThrows) {
  steering_.answer = [&](const SessionSoFar&) -> std::optional<Decision> {
    throw FileError(folder_, "open", "no memory is left");
  };
  EXPECT_THAT([&] { run(); }, ThrowsMessage<FileError>(HasSubstr("no memory is left")));
}

TEST_F(SteeredSession, GoesOnInTheMiddleOfAddedPointsToTheSamePlaces) {
  fail_point_1();
  std::stop_source pause;
  steering_.answer = [&](const SessionSoFar& now) -> std::optional<Decision> {
    if (std::optional<Decision> found = replacement(now)) {
      // All is decided, and nothing of it measured, when the session is paused.
      AddedPoint second = more(1, now.plan);
      ++second.point;
      found->added.push_back(second);
      pause.request_stop();
      return found;
    }
    return std::nullopt;
  };
  SessionPart part;
  part.pause = pause.get_token();
  EXPECT_FALSE(run(part).finished);
  EXPECT_THAT(measured(), ElementsAre(0));

  const ResumeState state = resume_state(SessionReader(folder_));
  for (const LoggedDecision& each : state.decisions) add_points(each.decision, plan_);
  ASSERT_THAT(plan_.points, SizeIs(5));
  EXPECT_EQ(plan_.points[3].pose.joints, more(0, plan_).pose.joints);
  SessionWriter archive = SessionWriter::resume(folder_, files::ProcessLock(session_lock(folder_)),
                                                state.may_begin_at, rig_.clock.now(), "");
  steering_.answer = [](const SessionSoFar&) { return std::nullopt; };
  const SessionResult result = run_session(rig_.devices(), rig_.known, plan_, options_, archive, {},
                                           {}, part_to_resume(state), &steering_);
  EXPECT_TRUE(result.complete);
  EXPECT_THAT(measured(), ElementsAre(0, 2, 3, 4)) << "the failed one is not tried again";
}

}  // namespace
}  // namespace gonio::acquisition
