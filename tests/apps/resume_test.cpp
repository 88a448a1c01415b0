// Sessions that were stopped, paused or killed, and go on in a new process.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "gonio/acquisition/session_archive.h"
#include "workflow.h"

namespace gonio {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Field;
using testing::HasSubstr;

const std::string kSteady = kSmallRig + kSteadyWorld;

class Resume : public Workflow {
 protected:
  void SetUp() override {
    Workflow::SetUp();
    folder.write("rig.toml", kSteady);
    folder.write("slow.toml", kSteady + "time_scale = 60.0\n");
  }

  std::vector<std::string> measure(const std::string& rig, const std::string& out) const {
    return {"measure",          rig,     "--plan", "list.csv", "--material",
            "builtin:red-pmma", "--out", out,      "--verbose"};
  }
  std::string samples_of(const std::string& session) {
    run({"reduce", session, "--out", session + ".csv"});
    // Where the samples come from stands above them.
    std::string text = folder.read(session + ".csv");
    std::string rows;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("#")) rows += line + "\n";
    }
    return rows;
  }
  nlohmann::json status(const std::string& session, int expected) {
    return nlohmann::json::parse(run({"status", session, "--json"}, expected).out);
  }
};

TEST_F(Resume, GivesTheSamplesOfTheUninterruptedSessionToTheByteAfterAKill) {
  run(measure("rig.toml", "whole"));
  const std::string wanted = samples_of("whole");
  // At the moments that it names on its way; in between, tests/scenarios/kill_sweep_test.cpp.
  for (const char* moment : {"white", "point 2, 2 of", "closing white"}) {
    SCOPED_TRACE(moment);
    const std::string session = std::string("killed ") + moment;
    {
      GonioProcess measuring(measure("slow.toml", session), folder.path());
      ASSERT_TRUE(measuring.wait_for(moment));
      measuring.send(SIGKILL);
      measuring.wait();
    }
    EXPECT_EQ(status(session, 4)["state"], "interrupted");
    run({"resume", session, "--outage", "600"});
    EXPECT_EQ(status(session, 0)["state"], "complete");
    EXPECT_EQ(samples_of(session), wanted);
    EXPECT_THAT(run({"resume", session}).error, HasSubstr("is finished"));
  }
}

TEST_F(Resume, SaysThatTheJournalHasLostItsEndKeepsTheFramesAndMeasuresAgain) {
  run(measure("rig.toml", "whole"));
  {
    GonioProcess measuring(measure("slow.toml", "killed"), folder.path());
    ASSERT_TRUE(measuring.wait_for("closing white"));
    measuring.send(SIGKILL);
    measuring.wait();
  }
  // All that a killed session has acknowledged is in the log yet.
  const std::filesystem::path log = folder.path() / "killed/session.sqlite-wal";
  std::filesystem::resize_file(log, std::filesystem::file_size(log) / 2);
  EXPECT_THAT(status("killed", 4)["damage"].dump(), HasSubstr("the journal has lost its end"));
  EXPECT_THAT(run({"resume", "killed", "--outage", "600"}).error,
              HasSubstr("the journal has lost its end"));
  EXPECT_EQ(status("killed", 0)["measured"], 5);
  EXPECT_EQ(samples_of("killed"), samples_of("whole"));
  int kept = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder.path() / "killed/frames")) {
    kept += entry.path().filename().string().find("without-row") != std::string::npos ? 1 : 0;
  }
  EXPECT_GT(kept, 1);
}

TEST_F(Resume, WritesNothingIntoAnotherSessionThatWasPutInItsPlaceMeanwhile) {
  run(measure("rig.toml", "whole"));
  const std::string wanted = samples_of("whole");
  for (const bool replaced : {true, false}) {
    SCOPED_TRACE(replaced);
    const std::string session = replaced ? "replaced" : "only moved";
    GonioProcess measuring(measure("slow.toml", session), folder.path());
    ASSERT_TRUE(measuring.wait_for("closing white"));
    std::filesystem::rename(folder.path() / session, folder.path() / (session + " away"));
    if (replaced) {
      std::filesystem::copy(folder.path() / "whole", folder.path() / session,
                            std::filesystem::copy_options::recursive);
    }
    const Ended ended = measuring.wait();
    EXPECT_EQ(ended.exit_code, 4) << ended.error;
    EXPECT_THAT(ended.error, AllOf(HasSubstr("was moved, replaced or deleted meanwhile"),
                                   HasSubstr("gonio resume FOLDER, where it is now")));
    if (replaced) {
      EXPECT_EQ(samples_of(session), wanted);
    } else {
      EXPECT_FALSE(std::filesystem::exists(folder.path() / session));
    }
    run({"resume", session + " away", "--outage", "600"});
    EXPECT_EQ(samples_of(session + " away"), wanted);
  }
}

TEST_F(Resume, TakesAFinishedSessionWhosePointsStayedSuspectForNoDamagedOne) {
  // Home marks that are found a tenth of a degree off each time.
  folder.write("loose.toml", "[simulation]\nhoming_sigma_deg = 0.1\n");
  EXPECT_THAT(run(measure("loose.toml", "session")).error, HasSubstr("suspect"));
  EXPECT_FALSE(status("session", 0)["suspects"].empty());
  EXPECT_THAT(run({"resume", "session"}).error, HasSubstr("is finished, there is nothing left"));
}

TEST_F(Resume, CannotMendAFinishedSessionAndSaysSo) {
  run(measure("rig.toml", "session"));
  std::filesystem::resize_file(folder.path() / "session/frames/000030.tiff", 100);
  EXPECT_THAT(run({"status", "session"}, 4).out, HasSubstr("complete, but damaged since"));
  EXPECT_THAT(run({"resume", "session"}, 4).error,
              AllOf(HasSubstr("frame 30"), HasSubstr("was damaged afterwards"),
                    HasSubstr("a new session measures the rest")));
}

TEST_F(Resume, LeavesASessionAloneThatALiveProcessMeasures) {
  folder.write("slow.toml", kSteady + "time_scale = 1.0\n");
  const auto foreseen =
      nlohmann::json::parse(run({"measure", "slow.toml", "--plan", "list.csv", "--material",
                                 "builtin:red-pmma", "--dry-run", "--json"})
                                .out);
  GonioProcess measuring(measure("slow.toml", "session"), folder.path());
  ASSERT_TRUE(measuring.wait_for("home"));
  const auto running = status("session", 4);
  EXPECT_EQ(running["state"], "running");
  EXPECT_NEAR(running["remaining_s"].get<double>(), foreseen["duration_s"].get<double>(), 1.0)
      << "all of it: it is homing";
  EXPECT_THAT(run({"status", "session"}, 4).out, HasSubstr("of session time from its beginning"));
  EXPECT_THAT(run({"resume", "session"}, 2).error,
              HasSubstr("process " + std::to_string(measuring.pid()) + " is measuring it"));
  measuring.send(SIGKILL);
  measuring.wait();
  const auto killed = status("session", 4);
  EXPECT_EQ(killed["state"], "interrupted") << "a dead owner's lock is free";
  EXPECT_FALSE(killed.contains("remaining_s"));
}

TEST_F(Resume, LooksOnceMoreWhetherItsCalibrationAndAlignmentHold) {
  {
    GonioProcess measuring(measure("slow.toml", "killed"), folder.path());
    ASSERT_TRUE(measuring.wait_for("point 1, 1 of"));
    measuring.send(SIGKILL);
    measuring.wait();
  }
  // The same session, begun with a calibration and an alignment of long ago.
  const acquisition::SessionReader killed(folder.path() / "killed");
  const auto begun_with = [&](const std::string& name, acquisition::SessionMetadata more) {
    more.insert(killed.metadata().begin(), killed.metadata().end());
    acquisition::SessionWriter(folder.path() / name, more, killed.configuration());
  };
  begun_with("old", {{"calibration_valid_until_utc", "2020-01-02T03:04:05Z"},
                     {"alignment_found_utc", "2020-01-01T03:04:05Z"}});
  EXPECT_THAT(run({"resume", "old"}, 2).error,
              AllOf(HasSubstr("its calibration was valid until 2020-01-02 03:04 UTC"),
                    HasSubstr("its alignment is of 2020-01-01 03:04 UTC"),
                    HasSubstr("--accept-calibration")));
  run({"resume", "old", "--accept-calibration"});
  const acquisition::SessionReader went_on(folder.path() / "old");
  EXPECT_TRUE(went_on.finished());
  EXPECT_THAT(went_on.notes(),
              Contains(Field(&acquisition::SessionNote::text,
                             HasSubstr("accepted though its calibration was valid until"))));

  begun_with("still", {{"calibration_valid_until_utc", "2999-01-02T03:04:05Z"}});
  run({"resume", "still"});
  begun_with("accepted", {{"calibration_valid_until_utc", "2020-01-02T03:04:05Z"},
                          {"calibration_accepted_despite", "white is expired"}});
  run({"resume", "accepted"});
  begun_with("spoilt", {{"calibration_valid_until_utc", "yesterday"}});
  EXPECT_THAT(run({"resume", "spoilt"}, 2).error, HasSubstr("calibration_valid_until_utc"));
}

TEST_F(Resume, PausesAfterThePointAtTheFirstInterrupt) {
  folder.write("slow.toml", kSteady + "time_scale = 10.0\n");
  GonioProcess measuring(measure("slow.toml", "session"), folder.path());
  ASSERT_TRUE(measuring.wait_for("point 1, 1 of 5"));
  measuring.send(SIGINT);
  const Ended ended = measuring.wait();
  EXPECT_EQ(ended.exit_code, 4) << ended.error;
  EXPECT_THAT(ended.error, HasSubstr("pausing after this point"));
  EXPECT_THAT(ended.error, HasSubstr("paused after"));
  EXPECT_THAT(ended.error, HasSubstr("gonio resume session"));
  const auto paused = status("session", 4);
  EXPECT_EQ(paused["points"], 5) << "of the plan, tried or not";
  EXPECT_EQ(paused["state"], "paused");
  EXPECT_THAT(paused["damage"], testing::IsEmpty());
  const int measured = paused["measured"].get<int>();
  EXPECT_GE(measured, 2) << "the point under way was finished";
  EXPECT_THAT(ended.error, testing::ContainsRegex(
                               "5 point\\(s\\) to measure, about .*, 90 % within "
                               ".* to .* of session time; until about [0-9][0-9]:[0-9][0-9]"));
  EXPECT_THAT(run({"reduce", "session", "--out", "samples.csv"}).error,
              AllOf(HasSubstr("did not come to its end"), HasSubstr("there is but one white")));
  const Ended resumed = run({"resume", "session"});
  EXPECT_THAT(
      resumed.error,
      AllOf(HasSubstr(std::to_string(measured) + " of 5 points are done"),
            HasSubstr("axes over the interruption"), HasSubstr("no factor is applied"),
            testing::ContainsRegex(std::to_string(5 - measured) +
                                   " point\\(s\\) to measure, about .*, 90 % within .* to "),
            HasSubstr(", " + std::to_string(5 - measured) + " of them now; this part took ")));
  const auto complete = status("session", 0);
  EXPECT_EQ(complete["measured"], 5);
  EXPECT_THAT(complete["bridges"].get<std::vector<std::string>>(),
              testing::ElementsAre(HasSubstr("no factor is applied")));
}

TEST_F(Resume, StopsAtOnceAtTheSecondInterruptOrWhenTerminated) {
  folder.write("slow.toml", kSteady + "time_scale = 2.0\n");
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT}) {
    const std::string session = "signal" + std::to_string(signal);
    GonioProcess measuring(measure("slow.toml", session), folder.path());
    ASSERT_TRUE(measuring.wait_for("home"));
    measuring.send(signal);
    if (signal == SIGINT) {
      ASSERT_TRUE(measuring.wait_for("pausing"));
      measuring.send(SIGINT);
    }
    const Ended ended = measuring.wait();
    EXPECT_EQ(ended.exit_code, 4) << ended.error;
    EXPECT_THAT(ended.error, HasSubstr("stopped after 0 of 5"));
    EXPECT_EQ(status(session, 4)["state"], "interrupted");
    EXPECT_THAT(run({"reduce", session, "--out", "samples.csv"}, 2).error,
                HasSubstr("gonio resume " + session + " goes on"));
  }
}

TEST_F(Resume, SaysThatAStopWaitsForTheTargetChanger) {
  folder.write("changer.toml",
               kSmallRig + "[simulation]\nchange_time_s = 200.0\ntime_scale = 20.0\n");
  GonioProcess measuring(measure("changer.toml", "session"), folder.path());
  ASSERT_TRUE(measuring.wait_for("brings the white reference"));
  measuring.send(SIGTERM);
  const Ended ended = measuring.wait();
  EXPECT_EQ(ended.exit_code, 4) << ended.error;
  EXPECT_THAT(ended.error, HasSubstr("the program ends once the target changer is where it was"));
}

TEST_F(Resume, RefusesAnArchiveThatSaysWhatNoSessionSays) {
  run(measure("rig.toml", "whole"));
  const acquisition::SessionReader whole(folder.path() / "whole");
  const std::map<std::string, std::string> crafted{
      {"driver", "martian"}, {"radiometric_scale", "furlong"}, {"seed", "nan"}};
  for (const auto& [key, value] : crafted) {
    SCOPED_TRACE(key);
    acquisition::SessionMetadata metadata = whole.metadata();
    metadata[key] = value;
    acquisition::SessionWriter(folder.path() / key, metadata, whole.configuration());
    EXPECT_THAT(run({"resume", key}, 2).error,
                AllOf(HasSubstr(key + ": metadata " + key), HasSubstr(value)));
    EXPECT_TRUE(acquisition::SessionReader(folder.path() / key).notes().empty());
  }
}

TEST_F(Resume, RefusesWhatItCannotGoOnWith) {
  EXPECT_THAT(run({"resume", "nothing"}, 2).error, HasSubstr("found no session.sqlite"));
  std::filesystem::create_directory(folder.path() / "empty");
  folder.write("empty/session.sqlite", "");
  EXPECT_EQ(run_gonio({"resume", "empty"}, folder.path()).exit_code, 2);
}

TEST_F(Resume, RefusesAClockThatIsDecadesAheadBeforeAnythingIsOpened) {
  run(measure("rig.toml", "whole"));
  const acquisition::SessionReader whole(folder.path() / "whole");
  // Begun so long ago as by a clock that is wrong now, with a calibration that it makes too old.
  for (const std::string year : {"1990", "1601"}) {
    SCOPED_TRACE(year);
    acquisition::SessionMetadata metadata = whole.metadata();
    metadata["driver"] = "hardware";
    metadata["radiometric_scale"] = "si";
    metadata["provenance_started_utc"] = year + "-01-02T03:04:05Z";
    metadata["calibration_valid_until_utc"] = year + "-06-02T03:04:05Z";
    acquisition::SessionWriter(folder.path() / year, metadata, whole.configuration());
    EXPECT_THAT(run({"resume", year}, 2).error,
                AllOf(HasSubstr("was begun more than 29 years ago by its journal, or by the clock"),
                      HasSubstr("set the clock of this computer"),
                      testing::Not(HasSubstr("to measure, about"))));
    EXPECT_TRUE(acquisition::SessionReader(folder.path() / year).notes().empty());
  }
}

}  // namespace
}  // namespace gonio
