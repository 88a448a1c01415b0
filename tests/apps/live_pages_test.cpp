// The pages that the real program serves.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <nlohmann/json.hpp>
#include <regex>

#include "loopback_client.h"
#include "workflow.h"

namespace gonio {
namespace {

using testing::HasSubstr;

/// What the program has printed.
struct Printed {
  std::uint16_t port = 0;
  std::string token;
};

class LivePages : public Workflow {
 protected:
  void SetUp() override {
    Workflow::SetUp();
    folder.write("slow.toml", kSmallRig + kSteadyWorld + "time_scale = 60.0\n");
  }
  std::vector<std::string> measure(const std::string& out) const {
    return {"measure", "slow.toml", "--plan",    "list.csv", "--material", "builtin:red-pmma",
            "--out",   out,         "--monitor", "0",        "--verbose"};
  }
  /// Waits for the line with the token, or for the other address.
  static Printed printed(GonioProcess& program, const std::string& last_words) {
    EXPECT_TRUE(program.wait_for(last_words)) << program.said();
    std::smatch found;
    const std::string said = program.said();
    if (!std::regex_search(said, found, std::regex("http://127\\.0\\.0\\.1:(\\d+)/"))) {
      ADD_FAILURE() << said;
      return {};
    }
    Printed printed{static_cast<std::uint16_t>(std::stoi(found[1])), ""};
    if (std::regex_search(said, found, std::regex("/#([0-9a-f]{32}) "))) printed.token = found[1];
    return printed;
  }
};

TEST_F(LivePages, PauseASessionThatResumeFinishes) {
  GonioProcess measuring(measure("session"), folder.path());
  const Printed page = printed(measuring, "(may also pause and stop)");
  ASSERT_TRUE(measuring.wait_for("point 1, 1 of"));
  const auto state = nlohmann::json::parse(get(page.port, "/state.json").body);
  EXPECT_EQ(state["points_total"], 5);
  EXPECT_EQ(state["time_scale"], 60.0);
  EXPECT_EQ(ask(page.port, "POST", "/pause", "X-Gonio-Token: " + page.token + "\r\n").status, 200);
  const Ended paused = measuring.wait();
  EXPECT_EQ(paused.exit_code, 4) << paused.error;
  EXPECT_THAT(paused.error, HasSubstr("paused after"));
  EXPECT_THAT(paused.error, HasSubstr("gonio resume session goes on with it"));
  EXPECT_THAT(run({"status", "session"}, 4).out, HasSubstr("paused"));
  run({"resume", "session", "--monitor=0"});
}

TEST_F(LivePages, StopASession) {
  GonioProcess measuring(measure("session"), folder.path());
  const Printed page = printed(measuring, "(may also pause and stop)");
  ASSERT_TRUE(measuring.wait_for("point 1, 1 of"));
  EXPECT_EQ(ask(page.port, "POST", "/stop", "X-Gonio-Token: " + page.token + "\r\n").status, 200);
  const Ended stopped = measuring.wait();
  EXPECT_EQ(stopped.exit_code, 4) << stopped.error;
  EXPECT_THAT(stopped.error, HasSubstr("stopped after"));
  EXPECT_THAT(stopped.error, HasSubstr("gonio resume session goes on with it"));
}

TEST_F(LivePages, ShowWhatTheCameraSeesUntilInterrupted) {
  GonioProcess snapping({"snap", "rig.toml", "--channel", "G", "--monitor", "0"}, folder.path());
  const Printed page = printed(snapping, "(Ctrl-C ends)");
  int number = 0;
  // A camera that gives none runs into the time limit of the test.
  while (number < 2) {
    number = nlohmann::json::parse(get(page.port, "/setup.json").body)["number"];
  }
  EXPECT_THAT(get(page.port, "/frame.png").body, testing::StartsWith("\x89PNG"));
  snapping.send(SIGINT);
  const Ended ended = snapping.wait();
  EXPECT_EQ(ended.exit_code, 0) << ended.error;
}

TEST_F(LivePages, ShowTheReconstructionAsItGrows) {
  train();
  folder.write("paced.toml", kSmallRig + kSteadyWorld + "time_scale = 1.5\n");
  // Long enough for a busy machine; stopped as soon as there is a picture.
  std::string list = "theta_h_deg,theta_d_deg,phi_d_deg\n";
  for (int theta_h_deg = 4; theta_h_deg <= 24; theta_h_deg += 2) {
    for (int theta_d_deg = 10; theta_d_deg <= 35; theta_d_deg += 5) {
      list += std::to_string(theta_h_deg) + "," + std::to_string(theta_d_deg) + ",90\n";
    }
  }
  folder.write("long.csv", list);
  GonioProcess measuring({"measure", "paced.toml", "--plan", "long.csv", "--skip-unreachable",
                          "--material", "builtin:red-pmma", "--out", "session", "--monitor", "0",
                          "--basis", "basis.h5", "--verbose"},
                         folder.path());
  const Printed page = printed(measuring, "(may also pause and stop)");
  EXPECT_EQ(get(page.port, "/sphere.png").status, 404);
  ASSERT_TRUE(measuring.wait_for("point 1, 1 of"));
  nlohmann::json state;
  do {
    state = nlohmann::json::parse(get(page.port, "/state.json").body);
  } while (state["reconstruction"]["number"] == 0 && state["reconstruction"]["message"] == "" &&
           state["is_over"] == false);
  EXPECT_EQ(state["reconstruction"]["message"], "");
  EXPECT_GE(state["reconstruction"]["number"], 1);
  EXPECT_GE(state["reconstruction"]["points"], 1);
  EXPECT_THAT(get(page.port, "/sphere.png").body, testing::StartsWith("\x89PNG"));
  ask(page.port, "POST", "/stop", "X-Gonio-Token: " + page.token + "\r\n");
  EXPECT_EQ(measuring.wait().exit_code, 4);
}

TEST_F(LivePages, AreRefusedBeforeAnythingMoves) {
  GonioProcess first(measure("first"), folder.path());
  const Printed page = printed(first, "(may also pause and stop)");
  std::vector<std::string> second = measure("second");
  second[8] = "--monitor=" + std::to_string(page.port);
  second.erase(second.begin() + 9);
  EXPECT_THAT(run(second, 2).error, HasSubstr("cannot listen on 127.0.0.1:"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "second"));

  const auto refused = [&](const std::vector<std::string>& more) {
    std::vector<std::string> arguments{"measure",    "rig.toml",         "--plan", "list.csv",
                                       "--material", "builtin:red-pmma", "--out",  "third"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments, 2).error;
  };
  EXPECT_THAT(refused({"--monitor", "70000"}), HasSubstr("expected a port from 0 to 65535"));
  EXPECT_THAT(refused({"--monitor=0", "--monitor-address", "localhost"}),
              HasSubstr("--monitor-address: address: found \"localhost\""));
  EXPECT_THAT(refused({"--monitor=0", "--basis", "list.csv"}), HasSubstr("list.csv"));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "third"));
}

}  // namespace
}  // namespace gonio
