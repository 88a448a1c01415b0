// SIGKILL at random instants of `gonio measure`, sometimes of `gonio resume` as well: the session
// that is resumed gives the samples and the reconstruction of the uninterrupted one to the byte.
// GONIO_KILLS says how many, 50 unless told otherwise, GONIO_KILL_SEED which.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "workflow.h"

namespace gonio {
namespace {

using Clock = std::chrono::steady_clock;

/// What a session says first; its archive is there by then.
constexpr const char* kBeginning = "home";

const std::string kTinySteadyRig = R"([camera]
width_px = 48
height_px = 40
fx_px = 215.0
fy_px = 215.0
cx_px = 23.5
cy_px = 19.5
[session]
white_frames = 1
dark_frames = 2
)" + kSteadyWorld;

class RandomKills : public Workflow {
 protected:
  void SetUp() override {
    Workflow::SetUp();
    folder.write("rig.toml", kTinySteadyRig);
    train();
  }

  static std::vector<std::string> measure(const std::string& out) {
    return {"measure",          "rig.toml", "--plan", "list.csv", "--material",
            "builtin:red-pmma", "--out",    out,      "-v"};
  }

  /// Runs it and kills it a random part of `time` after its session began, unless it has ended.
  /// Whether it was killed.
  bool kill_within(Clock::duration time, const std::vector<std::string>& arguments) {
    constexpr double kOneIn32Bits = 1.0 / 4294967296.0;
    const double share = static_cast<double>(random_()) * kOneIn32Bits;
    GonioProcess process(arguments, folder.path());
    process.wait_for(kBeginning);
    const bool ended =
        process.ends_within(std::chrono::duration_cast<std::chrono::nanoseconds>(time * share));
    if (!ended) process.send(SIGKILL);
    process.wait();
    return !ended;
  }

  /// The rows of samples.csv.
  std::string samples_of(const std::string& session) {
    run({"reduce", session, "--out", session + ".csv", "-q"});
    std::istringstream lines(folder.read(session + ".csv"));
    std::string rows;
    for (std::string line; std::getline(lines, line);) {
      if (!line.starts_with("#")) rows += line + "\n";  // where they come from stands above them
    }
    return rows;
  }

  /// The MERL file that comes of samples_of().
  std::string table_of(const std::string& session) {
    // Not to be trusted, of five directions and ten training materials; the bytes are what counts.
    run({"reconstruct", session + ".csv", "--basis", "basis.h5", "--out", session + ".binary",
         "-q"},
        5);
    return folder.read(session + ".binary");
  }

  static unsigned number(const char* variable, unsigned otherwise) {
    const char* told = std::getenv(variable);
    return told != nullptr ? static_cast<unsigned>(std::atoi(told)) : otherwise;
  }

  std::mt19937 random_{number("GONIO_KILL_SEED", 6)};
};

TEST_F(RandomKills, LoseNothingAndChangeNoByte) {
  const int kills = static_cast<int>(number("GONIO_KILLS", 50));
  constexpr int kTableEvery = 10;
  constexpr int kTwiceEvery = 3;
  GonioProcess whole(measure("whole"), folder.path());
  ASSERT_TRUE(whole.wait_for(kBeginning));
  const auto began = Clock::now();
  ASSERT_EQ(whole.wait().exit_code, 0);
  Clock::duration time = Clock::now() - began;
  const std::string samples = samples_of("whole");
  const std::string table = table_of("whole");
  ASSERT_FALSE(table.empty());
  int resumed = 0;
  int twice = 0;
  int never_begun = 0;
  int had_ended = 0;
  for (int kill = 0; kill < kills && !HasFailure(); ++kill) {
    const std::string session = "session" + std::to_string(kill);
    SCOPED_TRACE(session);
    if (!kill_within(time, measure(session))) {
      ++had_ended;
      time -= time / 10;  // the machine has less to do than when it was taken
      continue;
    }
    if (!std::filesystem::exists(folder / (session + "/frames/000001.tiff"))) {
      ++never_begun;  // before there was anything to go on with
      continue;
    }
    if (kill % kTwiceEvery == 0 && kill_within(time, {"resume", session, "-v"})) ++twice;
    run({"resume", session, "-q", "--outage", std::to_string(kill)});
    EXPECT_EQ(nlohmann::json::parse(run({"status", session, "--json"}).out)["measured"], 5);
    EXPECT_EQ(samples_of(session), samples);
    if (kill % kTableEvery == 0) {
      EXPECT_EQ(table_of(session), table);
    }
    ++resumed;
    std::filesystem::remove_all(folder / session);
  }
  EXPECT_GE(resumed, kills / 2) << "most instants lie within the session";
  std::printf(
      "%d kills: %d resumed (%d of them killed again meanwhile), %d before the first frame, "
      "%d after the end\n",
      kills, resumed, twice, never_begun, had_ended);
}

}  // namespace
}  // namespace gonio
