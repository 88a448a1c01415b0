// Sessions over the real protocols whose process is killed; and two processes on one rig.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "wire_machine.h"

namespace gonio {
namespace {

using testing::HasSubstr;

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
  folder_.write("kill.sh", std::string("gonio=\"") + GONIO_PROGRAM + R"("
"$gonio" measure rig.toml --plan list.csv --out session -v 2>log &
child=$!
until grep -q "point 3 of" log; do kill -0 $child || exit 9; done
kill -KILL $child
"$gonio" resume session 2>second
echo $? >code
)");
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

}  // namespace
}  // namespace gonio
