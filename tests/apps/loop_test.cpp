// The closed loop of whole sessions on the simulated rig.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <set>

#include "gonio/acquisition/decisions.h"
#include "gonio/acquisition/session_archive.h"
#include "workflow.h"

namespace gonio {
namespace {

using acquisition::Decision;
using acquisition::LoggedDecision;
using acquisition::PointOutcome;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;
using testing::SizeIs;

const std::string kSteady = kSmallRig + kSteadyWorld;

/// No exposure is short enough for a highlight.
std::string saturating() {
  std::string rig = kSteady;
  return rig.insert(rig.find("[session]"), "min_exposure_us = 20000.0\n");
}

class Loop : public Workflow {
 protected:
  void SetUp() override {
    Workflow::SetUp();
    folder.write("rig.toml", kSteady);
    folder.write("slow.toml", kSteady + "time_scale = 60.0\n");
    // Enough materials to foresee a score.
    std::vector<std::string> arguments = kTrain;
    arguments.insert(arguments.end(),
                     {"builtin:steel-ground", "builtin:yellow-abs", "builtin:copper-brushed"});
    arguments.insert(arguments.end(), {"--out", "basis.h5", "--components", "12"});
    run(arguments);
  }

  std::vector<std::string> measure(const std::string& rig, const std::string& material,
                                   const std::string& out,
                                   const std::vector<std::string>& more) const {
    std::vector<std::string> arguments{"measure",    rig,      "--plan",   "list.csv",
                                       "--material", material, "--basis",  "basis.h5",
                                       "--out",      out,      "--verbose"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  }
  acquisition::SessionReader archive(const std::string& name) const {
    return acquisition::SessionReader(folder.path() / name);
  }
  void expect_replayed(const std::string& name, std::size_t count) {
    EXPECT_EQ(run({"status", name, "--replay"}).out, std::to_string(count) + " of " +
                                                         std::to_string(count) +
                                                         " decisions are what the archive gives\n");
  }
};

TEST_F(Loop, ReplacesPointsThatCannotBeMeasured) {
  folder.write("rig.toml", saturating());
  const Ended ended =
      run(measure("rig.toml", "builtin:chrome-plate", "session", {"--max-points", "5"}));
  EXPECT_THAT(ended.error, HasSubstr("ended as saturated: point 5"));
  const acquisition::SessionReader session = archive("session");
  std::set<int> failed;
  for (const acquisition::PointRecord& point : session.points()) {
    if (point.outcome != PointOutcome::Measured) failed.insert(point.point);
  }
  EXPECT_FALSE(failed.empty());
  const std::vector<LoggedDecision> log = acquisition::decisions(session);
  std::set<int> replaced;
  for (const LoggedDecision& each : log) {
    for (const acquisition::AddedPoint& added : each.decision.added) {
      if (added.replaces) replaced.insert(*added.replaces);
    }
  }
  EXPECT_EQ(replaced, failed);
  EXPECT_EQ(session.points().size() - failed.size(), 5U) << "as many as were planned";
  expect_replayed("session", log.size());
}

TEST_F(Loop, StopsWhenEnoughIsExpected) {
  folder.write("list.csv", kList + "10,15,40\n12,25,90\n30,40,20\n");
  const Ended ended = run(measure("rig.toml", "builtin:grey-pvc", "session", {"--until", "5"}));
  EXPECT_THAT(ended.error, AllOf(HasSubstr("enough after 5 points"), HasSubstr("3 left out")));
  EXPECT_THAT(archive("session").points(), SizeIs(5));
  EXPECT_TRUE(archive("session").finished());
  EXPECT_THAT(run({"status", "session"}).out,
              HasSubstr("points           8, 5 measured, 3 left out"));
  expect_replayed("session", 1);
}

TEST_F(Loop, GoesOnBehindThePlanAndSaysWhatCannotBeReached) {
  const Ended ended = run(
      measure("rig.toml", "builtin:grey-pvc", "session", {"--until", "90", "--max-points", "7"}));
  EXPECT_THAT(ended.error, AllOf(HasSubstr("90 dB are not reached"), HasSubstr("after 7 points"),
                                 AnyOf(HasSubstr("would better the usual one by"),
                                       HasSubstr("what more points would add is not known"))));
  EXPECT_THAT(ended.error, testing::ContainsRegex("point 6, 6 of 7 done, [0-9.]+ dB expected"));
  EXPECT_THAT(archive("session").points(), SizeIs(7));
  EXPECT_THAT(run({"status", "session", "--json"}).out, HasSubstr("90 dB are asked for"));
  expect_replayed("session", 3);
}

TEST_F(Loop, ResumesInTheMiddleOfAddedPointsToTheByte) {
  const std::vector<std::string> wish{"--until", "90", "--max-points", "8"};
  run(measure("rig.toml", "builtin:grey-pvc", "whole", wish));
  {
    GonioProcess measuring(measure("slow.toml", "builtin:grey-pvc", "killed", wish), folder.path());
    ASSERT_TRUE(measuring.wait_for("point 6, 6 of"));
    measuring.send(SIGKILL);
    measuring.wait();
  }
  run({"resume", "killed", "--outage", "600"});
  const auto texts = [&](const std::string& name) {
    std::vector<std::string> found;
    for (const LoggedDecision& each : acquisition::decisions(archive(name))) {
      found.push_back(acquisition::decision_text(each.decision));
    }
    return found;
  };
  EXPECT_EQ(texts("killed"), texts("whole"));
  const auto values = [&](const std::string& name) {
    run({"reduce", name, "--out", "samples.csv", "--force"});
    const std::string text = folder.read("samples.csv");
    return text.substr(text.find("\ntheta_h_deg"));
  };
  EXPECT_EQ(values("killed"), values("whole"));
  expect_replayed("killed", texts("killed").size());
}

TEST_F(Loop, GoesOnOnlyWithItsOwnBasisAndJournal) {
  {
    GonioProcess measuring(measure("slow.toml", "builtin:grey-pvc", "killed", {}), folder.path());
    ASSERT_TRUE(measuring.wait_for("point 1, 1 of"));
    measuring.send(SIGKILL);
    measuring.wait();
  }
  const acquisition::SessionReader killed = archive("killed");
  const auto tampered = [&](const std::string& name, const std::string& note) {
    acquisition::SessionWriter(folder.path() / name, killed.metadata(), killed.configuration())
        .note(std::chrono::seconds(1), acquisition::kDecisionNote, note);
    return run({"resume", name}, 2).error;
  };
  EXPECT_THAT(tampered("torn", "{\"decision\":\"add\""),
              AllOf(HasSubstr("note of 1.000 s"), HasSubstr("is no JSON")));
  Decision decision;
  acquisition::AddedPoint added;
  added.point = 5;
  added.direction = {Angle::from_degrees(10), Angle::from_degrees(15), Angle::from_degrees(40),
                     Angle()};
  added.pose.joints.assign(3, Angle::from_degrees(20.0));
  decision.added = {added};
  EXPECT_THAT(tampered("elsewhere", acquisition::decision_text(decision)),
              HasSubstr("do not realise this direction"));
  decision.added[0].pose.joints.pop_back();
  EXPECT_THAT(tampered("short", acquisition::decision_text(decision)), HasSubstr("2 joints"));
  decision.added[0].point = 9;
  EXPECT_THAT(tampered("gap", acquisition::decision_text(decision)),
              HasSubstr("found point 9 added, expected 5"));

  std::filesystem::rename(folder.path() / "basis.h5", folder.path() / "moved.h5");
  EXPECT_THAT(run({"resume", "killed"}, 2).error,
              AllOf(HasSubstr("its basis is no longer at"), HasSubstr("--basis FILE")));
  run({"resume", "killed", "--basis", "moved.h5"});
  run({"status", "killed", "--replay"}, 2);
  run({"status", "killed", "--replay", "--basis", "moved.h5"});
  EXPECT_THAT(run({"status", "killed", "--basis", "moved.h5"}, 2).error, HasSubstr("--replay"));

  std::vector<std::string> arguments = kTrain;
  arguments.insert(arguments.end(), {"--out", "basis.h5", "--components", "9"});
  run(arguments);
  EXPECT_THAT(run({"status", "killed", "--replay"}, 2).error,
              HasSubstr("is not the basis the session was begun with"));
}

TEST_F(Loop, SaysBeforehandThatItIsOnAndWhatItNeeds) {
  const std::vector<std::string> dry{"measure",    "rig.toml",         "--plan",   "list.csv",
                                     "--material", "builtin:grey-pvc", "--dry-run"};
  const auto with = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments = dry;
    arguments.insert(arguments.end(), more.begin(), more.end());
    return arguments;
  };
  EXPECT_THAT(
      run(with({"--basis", "basis.h5", "--until", "33"})).out,
      AllOf(HasSubstr("loop"), HasSubstr("expected at 33 dB"), HasSubstr("40 points at most")));
  EXPECT_THAT(run(with({"--basis", "basis.h5", "--until", "33", "--max-points", "9"})).error,
              HasSubstr("may stop before, or go on to 9 points"));
  EXPECT_THAT(run(with({"--until", "33"}), 2).error, HasSubstr("--until needs --basis"));
  EXPECT_THAT(run(with({"--max-points", "9"}), 2).error, HasSubstr("--max-points needs --basis"));
  std::vector<std::string> arguments = kTrain;
  arguments.insert(arguments.end(), {"--out", "few.h5", "--components", "9"});
  run(arguments);
  EXPECT_THAT(run(with({"--basis", "few.h5", "--until", "33"}), 2).error,
              HasSubstr("too few to foresee an error"));
}

}  // namespace
}  // namespace gonio
