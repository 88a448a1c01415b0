// Sessions over the real protocols whose process is killed; and two processes on one rig.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "gonio/acquisition/session_archive.h"
#include "gonio/acquisition/trust_notes.h"
#include "wire_machine.h"

namespace gonio {
namespace {

using testing::HasSubstr;

/// A session that is killed at its third point, and one that goes on with it.
const std::string kKilledAndResumed = std::string("gonio=\"") + GONIO_PROGRAM + R"("
"$gonio" measure rig.toml --plan list.csv --out session -v 2>log &
child=$!
until grep -q "point 2, 2 of" log; do kill -0 $child || exit 9; done
kill -KILL $child
"$gonio" resume session 2>second
echo $? >code
)";

TEST_F(OnTheWire, ASecondProgramIsRefusedWhileOneDrivesTheRig) {
  folder_.write("two.sh", std::string("gonio=\"") + GONIO_PROGRAM + R"("
"$gonio" shutter rig.toml open --channel G 2>log &
child=$!
until grep -q "G is lit" log; do kill -0 $child || exit 9; done
"$gonio" jog rig.toml tilt 1 2>second
echo $? >code
echo $child >first
kill -TERM $child
wait $child
"$gonio" shutter rig.toml close 2>>second
echo $? >code_after
)");
  in_the_machine("two.sh");
  EXPECT_EQ(std::stoi(folder_.read("code")), 2);
  EXPECT_THAT(folder_.read("second"),
              HasSubstr("is used by process " + std::to_string(std::stoi(folder_.read("first")))));
  EXPECT_EQ(std::stoi(folder_.read("code_after")), 0) << folder_.read("second");
}

// The next process waits until the watchdog of the first has stopped the rig, homes it anew and
// finds the devices that the session was begun with.
TEST_F(OnTheWire, AKilledSessionGoesOnInANewProcess) {
  folder_.write("kill.sh", kKilledAndResumed);
  GonioProcess({"rig.toml", "--time-scale", "50", "--", "bash", "kill.sh"}, folder_.path(), 0,
               GONIO_EMULATE)
      .wait();
  EXPECT_EQ(std::stoi(folder_.read("code")), 0) << folder_.read("second");
  EXPECT_THAT(folder_.read("second"), HasSubstr("of 5 points are done"));
  const auto status = nlohmann::json::parse(gonio({"status", "session", "--json"}).out);
  EXPECT_EQ(status["state"], "complete");
  EXPECT_EQ(status["measured"], 5);
  EXPECT_THAT(status["damage"], testing::IsEmpty());
  EXPECT_GE(reduced("session").samples.size(), 5U * 24U);
}

// The lamp arm stands still through all points, so that the kill does not meet it on its way.
TEST_F(OnTheWire, AnAxisThatSlippedDuringAnOutageIsHomedAwayAndWhatItMayHaveSpoiltTakenAgain) {
  const double slip_deg = 0.05;
  let_the_lamp_arm_tell();
  folder_.write("list.csv",
                "theta_h_deg,theta_d_deg,phi_d_deg\n3,20,28\n30,20,89\n15,20,130\n2,20,180\n"
                "20,20,60\n");
  folder_.write("slip.sh", kKilledAndResumed);
  // At the second homing: the first is that of `measure`.
  in_the_machine("slip.sh", {"--fault", "lost_steps@lamp_arm:skip=1,count=1,degrees=0.05"});
  EXPECT_EQ(std::stoi(folder_.read("code")), 0) << folder_.read("second");

  const acquisition::SessionReader archive(folder_.path() / "session");
  std::string compared;
  std::string suspect;
  std::string cannot_tell;
  std::chrono::nanoseconds resumed_at{0};
  for (const acquisition::SessionNote& note : archive.notes()) {
    if (note.kind == acquisition::kSuspectNote) suspect += note.text;
    if (note.kind != acquisition::kHomeDeltaNote) continue;
    if (note.text.find("cannot tell") != std::string::npos) cannot_tell += note.text;
    if (note.text.find("over the interruption") == std::string::npos) continue;
    resumed_at = note.at;
    compared = note.text;
  }
  EXPECT_THAT(compared, HasSubstr("lamp_arm +0.0"));
  const auto number = compared.find("lamp_arm ") + 9;
  ASSERT_LT(number, compared.size()) << compared;
  const double within_deg = std::stod(compared.substr(compared.find("within ") + 7));
  EXPECT_NEAR(std::stod(compared.substr(number)), slip_deg, within_deg + 0.015);
  EXPECT_THAT(cannot_tell, HasSubstr("azimuth, tilt cannot tell"));

  std::map<int, int> taken;
  std::string before;
  for (const acquisition::PointRecord& point : archive.points()) {
    ++taken[point.point];
    if (point.finished_at < resumed_at) before += " " + std::to_string(point.point);
  }
  EXPECT_THAT(suspect, testing::AllOf(testing::StartsWith("points" + before + ": "),
                                      HasSubstr("axis lamp_arm was off its count by +0.0")));
  EXPECT_EQ(taken.size(), 5U);
  for (const auto& [point, times] : taken) {
    const bool was_suspect = before.find(" " + std::to_string(point)) != std::string::npos;
    EXPECT_EQ(times, was_suspect ? 2 : 1) << "point " << point;
  }
}

}  // namespace
}  // namespace gonio
