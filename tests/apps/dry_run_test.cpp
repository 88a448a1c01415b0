#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "gonio/files/text_file.h"
#include "workflow.h"

namespace gonio {
namespace {

using nlohmann::json;
using testing::HasSubstr;

class DryRun : public Workflow {
 protected:
  std::vector<std::string> words(const std::vector<std::string>& more = {},
                                 const std::string& plan = "list.csv") const {
    std::vector<std::string> all{"measure",    "rig.toml",         "--plan",   plan,
                                 "--material", "builtin:red-pmma", "--dry-run"};
    all.insert(all.end(), more.begin(), more.end());
    return all;
  }
  json data(const std::vector<std::string>& more = {}, const std::string& plan = "list.csv",
            int expected = 0) {
    std::vector<std::string> all = words(more, plan);
    all.emplace_back("--json");
    return json::parse(run(all, expected).out);
  }
  static json check(const json& found, const std::string& name) {
    for (const json& each : found["checks"]) {
      if (each["name"] == name) return each;
    }
    ADD_FAILURE() << "no check named " << name;
    return {};
  }
};

TEST_F(DryRun, TakesAsLongAsThePlanSays) {
  train();
  const std::string rig = GONIO_RIGS "/lab_example.toml";
  const json planned = json::parse(run({"plan", "--basis", "basis.h5", "--samples", "4", "--rig",
                                        rig, "--out", "plan.csv", "--explain", "--json"})
                                       .out);
  const json found =
      json::parse(run({"measure", rig, "--plan", "plan.csv", "--dry-run", "--json"}).out);
  const double whole_s = found["duration_s"];
  EXPECT_NEAR(planned["session"]["duration_s"], whole_s, 1e-3 * whole_s);
}

TEST_F(DryRun, SaysThatMorePairsAreWantedThanThereCanBe) {
  EXPECT_THAT(run(words({"--repeat-pairs", "9"})).error,
              HasSubstr("9 pairs were asked for, 2 points have a place"));
}

TEST_F(DryRun, RefusesAnArchiveThatExistsAsTheSessionWould) {
  folder.write("taken", "");
  EXPECT_THAT(run(words({"--out", "taken"}), 2).error, HasSubstr("it exists"));
}

TEST_F(DryRun, ShowsTheSessionMovesNothingAndLeavesNothing) {
  const Ended ended = run(words());
  EXPECT_THAT(ended.out, HasSubstr("(39.00, 60.00, 89.00) deg"));
  EXPECT_THAT(ended.out, HasSubstr("whole session"));
  EXPECT_THAT(ended.out, testing::ContainsRegex("white .* [0-9.]+ +[0-9.]+\n"));
  EXPECT_THAT(ended.out, testing::ContainsRegex("    0  point "));
  EXPECT_THAT(ended.out, HasSubstr("lamp_arm"));
  EXPECT_THAT(ended.error, HasSubstr("nothing was moved"));
  EXPECT_THAT(folder.names(), testing::ElementsAre("list.csv", "rig.toml"));
}

TEST_F(DryRun, TellsAsDataWhatTheSessionThenTakes) {
  const json found = data();
  EXPECT_EQ(found["refused"], false);
  EXPECT_EQ(found["points"], 5);
  ASSERT_EQ(found["stops"].size(), 11U)
      << "home, dark, white, five points, home for its delta, white, park";
  double last_s = 0.0;
  int frames = 0;
  double sum_s = 0.0;
  for (const json& stop : found["stops"]) {
    sum_s += stop["predicted_s"].get<double>();
    EXPECT_NEAR(stop["ends_at_s"], sum_s, 1e-6) << stop["stop"];
    EXPECT_GT(stop["ends_at_s"], last_s) << stop["stop"];
    last_s = stop["ends_at_s"];
    if (stop["stop"] != "point") continue;
    EXPECT_LE(stop["predicted_low_s"], stop["predicted_s"]);
    EXPECT_GE(stop["predicted_high_s"], stop["predicted_s"]);
    EXPECT_GE(stop["longest_exposure_us"], stop["shortest_exposure_us"]);
    EXPECT_TRUE(stop.contains("tilt_deg"));
    frames += stop["frames"].get<int>();
  }
  EXPECT_NEAR(last_s, found["duration_s"], 1e-6) << "whites, homing and parking with it";
  EXPECT_GT(found["frames"], frames);
  EXPECT_GE(found["points_travel_s"], found["points_travel_at_least_s"]);
  EXPECT_GT(found["disk_free_bytes"], found["disk_needed_bytes"]);
  run({"measure", "rig.toml", "--plan", "list.csv", "--material", "builtin:red-pmma", "--out",
       "session"});
  const json status = json::parse(run({"status", "session", "--json"}).out);
  double taken = 0.0;  // by kind
  for (const json& count : status["frames"]) taken += count.get<double>();
  EXPECT_NEAR(found["frames"].get<double>(), taken, 0.07 * taken);
}

TEST_F(DryRun, RefusesWhatTheRunWouldRefuse) {
  folder.write("rig.toml",
               kSmallRig + "[white]\nplacement = \"in_frame\"\npatch_mm = [300.0, 0.0]\n");
  const Ended ended = run(words(), 2);
  EXPECT_THAT(ended.error, HasSubstr("the white reference is not in the camera's view"));
  EXPECT_THAT(ended.out, HasSubstr("refuse"));
  const json found = data({}, "list.csv", 2);
  EXPECT_EQ(found["refused"], true);
  EXPECT_EQ(check(found, "white")["result"], "refuse");
  EXPECT_EQ(check(found, "camera")["result"], "pass") << "what else was looked at is said";
}

TEST_F(DryRun, ListsAllThatIsLeftOutWithReasons) {
  folder.write("list.csv", kList + "2.84,89,15\n8.1,82,48\n");
  const json refused = data({}, "list.csv", 2);
  EXPECT_EQ(check(refused, "reach")["result"], "refuse");
  EXPECT_EQ(refused["skipped"].size(), 2U);
  EXPECT_EQ(refused["skipped"][0]["reason"], "BELOW_HORIZON");
  EXPECT_EQ(refused["skipped"][0]["line"], 7);
  const json skipped = data({"--skip-unreachable"});
  EXPECT_EQ(check(skipped, "reach")["result"], "note");
  EXPECT_EQ(skipped["points"], 5);
}

TEST_F(DryRun, KeepsAPlansOrderAndPoses) {
  run({"plan", "--directions", "nielsen-10", "--rig", "rig.toml", "--out", "plan.csv"});
  std::istringstream plan(folder.read("plan.csv"));
  std::vector<double> theta_d_deg;
  for (std::string line; std::getline(plan, line);) {
    if (line.starts_with("#") || line.starts_with("theta")) continue;
    theta_d_deg.push_back(std::stod(line.substr(line.find(',') + 1)));
  }
  ASSERT_EQ(theta_d_deg.size(), 10U);
  std::vector<double> shown;
  const json found = data({}, "plan.csv");
  for (const json& stop : found["stops"]) {
    if (stop["stop"] == "point") shown.push_back(stop["theta_d_deg"]);
  }
  for (std::size_t i = 0; i < shown.size(); ++i) EXPECT_NEAR(shown[i], theta_d_deg[i], 1e-9);
  // Ten points are ordered exactly: no order of these poses takes less.
  EXPECT_LT(found["points_travel_s"].get<double>(),
            1.2 * found["points_travel_at_least_s"].get<double>());
  std::vector<std::string> lines;
  std::istringstream again(folder.read("plan.csv"));
  for (std::string line; std::getline(again, line);) lines.push_back(line);
  std::reverse(lines.end() - 10, lines.end() - 5);
  std::string mixed;
  for (const std::string& line : lines) mixed += line + "\n";
  folder.write("mixed.csv", mixed);
  EXPECT_GT(data({}, "mixed.csv")["points_travel_s"], found["points_travel_s"]);
}

TEST_F(DryRun, ExpectsWhatItIsTold) {
  const json white = data({"--expect", "builtin:white-ptfe"});
  const json itself = data();
  EXPECT_LT(white["duration_s"], itself["duration_s"]) << "red PMMA is dark in green and blue";
  EXPECT_THAT(check(white, "exposure")["text"].get<std::string>(), HasSubstr("white-ptfe"));
  const Ended ended = run({"measure", "rig.toml", "--plan", "list.csv", "--json", "--out", "s",
                           "--material", "builtin:red-pmma"},
                          2);
  EXPECT_THAT(ended.error, HasSubstr("--json: goes with --dry-run"));
}

TEST_F(DryRun, KnowsLessOfARigOfMetalWithoutAWord) {
  const auto width = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all{
        "measure", GONIO_RIGS "/wire.toml", "--plan", "list.csv", "--dry-run", "--json", "--yes"};
    all.insert(all.end(), more.begin(), more.end());
    const json found = json::parse(run(all).out);
    return found["duration_high_s"].get<double>() - found["duration_low_s"].get<double>();
  };
  // One about as bright as what is expected without a word: a darker one takes longer, and is
  // wider.
  EXPECT_GT(width({}), width({"--expect", "builtin:grey-pvc"}));
}

TEST_F(DryRun, ForeseesTheChecksThatTheDrivesAllow) {
  const auto homings = [&](const std::string& rig) {
    const json found = json::parse(
        run({"measure", rig, "--plan", "list.csv", "--dry-run", "--json", "--yes"}).out);
    return std::count_if(found["stops"].begin(), found["stops"].end(),
                         [](const json& stop) { return stop["stop"] == "home"; });
  };
  std::string text = files::read_text_file(GONIO_RIGS "/wire.toml");
  const std::string apt = "driver = \"apt\"\n";
  const std::size_t at = text.find(apt);
  ASSERT_NE(at, std::string::npos);
  text.insert(at + apt.size(), "counts_until_homed = true\n");
  folder.write("tells.toml", text);
  EXPECT_EQ(homings(GONIO_RIGS "/wire.toml"), 1) << "at the start";
  EXPECT_EQ(homings("tells.toml"), 2) << "and in the end, to compare";
}

}  // namespace
}  // namespace gonio
