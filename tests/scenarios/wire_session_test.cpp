// The programs as a person runs them, over the real protocols: `gonio` drives what `gonio-emulate`
// puts on the wire.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gonio/samples/samples.h"
#include "wire_machine.h"
#include "workflow.h"

namespace gonio {
namespace {

using testing::HasSubstr;

// The same rig, the same hidden errors, other noise: what the drivers bring home is what a session
// in process brings home.
TEST_F(OnTheWire, AWholeSessionAgreesWithTheOneInProcess) {
  gonio({"measure", "rig.toml", "--simulate", "--plan", "list.csv", "--out", "simulated"});
  emulated({"--time-scale", "50", "--noise-seed", "2", "--account", "account.json"},
           {"measure", "rig.toml", "--plan", "list.csv", "--out", "wire"});
  const samples::SampleSet simulated = reduced("simulated");
  const samples::SampleSet wire = reduced("wire");
  std::map<std::pair<int, int>, const samples::Sample*> of_spot;
  for (const samples::Sample& sample : wire.samples) of_spot[{sample.pose, sample.spot}] = &sample;
  double sum = 0.0;
  double squares = 0.0;
  int count = 0;
  for (const samples::Sample& a : simulated.samples) {
    // At the picture's rim a spot may be seen by one of them alone.
    const auto found = of_spot.find({a.pose, a.spot});
    if (found == of_spot.end()) continue;
    const samples::Sample& b = *found->second;
    ASSERT_NEAR(a.direction.theta_h.degrees(), b.direction.theta_h.degrees(), 0.01);
    for (int c = 0; c < 3; ++c) {
      const double z = (a.value_per_sr[c] - b.value_per_sr[c]) /
                       std::hypot(a.sigma_per_sr[c], b.sigma_per_sr[c]);
      sum += z;
      squares += z * z;
      ++count;
    }
  }
  ASSERT_GE(count, 5 * 24 * 3);  // a spot may lie outside the picture
  RecordProperty("mean_z", std::to_string(sum / count));
  RecordProperty("chi2_per_dof", std::to_string(squares / count));
  EXPECT_LT(std::abs(sum / count), 0.2);
  EXPECT_GT(squares / count, 0.8);
  EXPECT_LT(squares / count, 1.25);

  const Ended status = gonio({"status", "wire", "--json"});
  const auto metadata = nlohmann::json::parse(status.out)["metadata"];
  EXPECT_EQ(metadata["driver"], "hardware");
  EXPECT_THAT(metadata["device_tilt"].get<std::string>(), HasSubstr("55000001"));
  EXPECT_THAT(metadata["device_monitor"].get<std::string>(), HasSubstr("P0000001"));
  std::ifstream file(folder_.path() / "account.json");
  EXPECT_GT(nlohmann::json::parse(file)["exposures_s"].get<double>(), 0.0);

  std::vector<std::string> train = kTrain;
  std::erase(train, "builtin:gold-satin");
  gonio(words(train, {"--out", "basis.h5", "--components", "8"}));
  for (const std::string session : {"simulated", "wire"}) {
    gonio({"reconstruct", session + ".csv", "--basis", "basis.h5", "--out", session + ".binary"});
  }
  const auto compared =
      nlohmann::json::parse(gonio({"compare", "simulated.binary", "wire.binary", "--json"}).out);
  RecordProperty("psnr_db", compared["psnr_a_db"].dump());
  // Far above what separates a reconstruction from its material.
  EXPECT_GT(compared["psnr_a_db"].get<double>(), 45.0);
}

TEST_F(OnTheWire, FindsWhatIsConnected) {
  const Ended found = emulated({}, {"devices", "--json"});
  const auto devices = nlohmann::json::parse(found.out);
  ASSERT_EQ(devices["cameras"].size(), 1U);
  EXPECT_EQ(devices["cameras"][0]["address"], "127.0.0.1");
  ASSERT_EQ(devices["usb"].size(), 2U);
  EXPECT_EQ(devices["usb"][0]["serial"], "55000001");
  EXPECT_EQ(devices["serial_ports"][0]["port"], "/dev/ttyUSB0");
}

TEST_F(OnTheWire, NothingIsThereWithoutTheEmulation) {
  const Ended ended = gonio({"home", "rig.toml"}, 3);
  EXPECT_THAT(ended.error, HasSubstr("disconnected"));
}

/// Reads the lamp's coil as a program of another make would, and the time that a killed program's
/// watchdog took, in ms.
const std::string kAfterTheKill = R"(
killed=$(date +%s%N)
until grep -q "watchdog" log; do :; done
echo $(( ($(date +%s%N) - killed) / 1000000 )) >took_ms
exec 3<>/dev/tcp/127.0.0.1/1502
printf '\x00\x01\x00\x00\x00\x06\x01\x01\x00\x00\x00\x01' >&3
head -c 10 <&3 | od -An -tu1 -j9 >coil
cat log >&2
)";

/// What the issue grants it.
constexpr double kWatchdogDeadline_ms = 1000.0;

// The axes would travel for more than a second; a third of a second into it the program is killed.
// What stands afterwards, read by another program, is on the way and stays there.
TEST_F(OnTheWire, AKilledProgramLeavesStandingAxes) {
  use_drives_that_know_their_home();
  folder_.write("kill.sh", std::string("gonio=\"") + GONIO_PROGRAM + R"("
"$gonio" home rig.toml -q >&2 || exit 9
"$gonio" goto rig.toml lamp_arm=10 azimuth=60 tilt=40 -v 2>log &
until grep -q "about" log; do kill -0 $! || exit 9; done
sleep 0.3
kill -KILL $!
)" + kAfterTheKill + R"(
# The ports are free once the watchdog has gone.
for attempt in 1 2 3 4 5 6 7 8; do
  "$gonio" jog rig.toml tilt 0 --json >first 2>>log && break
done
"$gonio" jog rig.toml tilt 0 --json >second
)");
  const Ended ended = in_the_machine("kill.sh");
  EXPECT_THAT(ended.error, HasSubstr("the shutter is closed"));
  EXPECT_LT(std::stod(folder_.read("took_ms")), kWatchdogDeadline_ms);
  const auto first = nlohmann::json::parse(folder_.read("first"));
  EXPECT_LT(first["lamp_arm_deg"].get<double>(), 89.0);
  EXPECT_GT(first["lamp_arm_deg"].get<double>(), 11.0);
  EXPECT_LT(first["azimuth_deg"].get<double>(), 59.0);
  EXPECT_LT(first["tilt_deg"].get<double>(), 39.0);
  const auto second = nlohmann::json::parse(folder_.read("second"));
  for (const char* axis : {"lamp_arm_deg", "azimuth_deg", "tilt_deg"}) {
    EXPECT_NEAR(second[axis].get<double>(), first[axis].get<double>(), 0.01) << axis;
  }
}

TEST_F(OnTheWire, AKilledProgramLeavesAClosedShutter) {
  folder_.write("kill.sh", std::string("gonio=\"") + GONIO_PROGRAM + R"("
"$gonio" shutter rig.toml open --channel G 2>log &
until grep -q "G is lit" log; do kill -0 $! || exit 9; done
kill -TSTP $!  # Ctrl-Z: an open shutter is not left alone
grep -q "^State:.T" /proc/$!/status && exit 8
kill -KILL $!
)" + kAfterTheKill);
  const Ended ended = in_the_machine("kill.sh");
  EXPECT_THAT(ended.error, HasSubstr("the shutter is closed"));
  EXPECT_LT(std::stod(folder_.read("took_ms")), kWatchdogDeadline_ms);
  EXPECT_EQ(std::stoi(folder_.read("coil")), 0);
}

// One axis that does not answer takes nothing from the others.
TEST_F(OnTheWire, ASilentAxisDoesNotKeepTheShutterOpen) {
  folder_.write("kill.sh", std::string("gonio=\"") + GONIO_PROGRAM + R"("
"$gonio" shutter rig.toml open --channel G 2>log &
until grep -q "G is lit" log; do kill -0 $! || exit 9; done
sleep 1  # four seconds of the world, after three of which the axis is silent
kill -KILL $!
exec 3<>/dev/tcp/127.0.0.1/1502
for attempt in 1 2 3 4 5 6 7 8 9 10; do
  printf '\x00\x01\x00\x00\x00\x06\x01\x01\x00\x00\x00\x01' >&3
  head -c 10 <&3 | od -An -tu1 -j9 >coil
  [ $(cat coil) -eq 0 ] && break
  sleep 0.1
done
)");
  in_the_machine("kill.sh", {"--fault", "dead_link@lamp_arm:after_s=3,for_s=8"});
  EXPECT_EQ(std::stoi(folder_.read("coil")), 0);
}

TEST_F(OnTheWire, AProgramThatLosesItsWatchdogStops) {
  folder_.write("lost.sh", std::string("gonio=\"") + GONIO_PROGRAM + R"("
"$gonio" shutter rig.toml open --channel G 2>log &
child=$!
until grep -q "G is lit" log; do kill -0 $! || exit 9; done
kill -KILL $(cat /proc/$child/task/*/children)
until grep -q "watchdog has died" log; do kill -0 $child || exit 9; done
exec 3<>/dev/tcp/127.0.0.1/1502
printf '\x00\x01\x00\x00\x00\x06\x01\x01\x00\x00\x00\x01' >&3
head -c 10 <&3 | od -An -tu1 -j9 >coil
kill -TERM $child
wait $child
)");
  in_the_machine("lost.sh");
  EXPECT_EQ(std::stoi(folder_.read("coil")), 0);
}

// Without it the camera is waited for ten seconds.
TEST_F(OnTheWire, ASignalIsHeardWhileASilentCameraIsWaitedFor) {
  folder_.write("stop.sh", std::string("gonio=\"") + GONIO_PROGRAM + R"("
"$gonio" rig check rig.toml --connect 2>log >&2 &
child=$!
# Its watchdog is there: it opens devices.
while kill -0 $child && [ -z "`cat /proc/$child/task/*/children`" ]; do :; done
stopped=$(date +%s%N)
kill -TERM $child
wait $child
echo $? >code
echo $(( ($(date +%s%N) - stopped) / 1000000 )) >took_ms
cat log >&2
)");
  const Ended ended = in_the_machine("stop.sh", {"--fault", "dead_link@camera"});
  EXPECT_THAT(ended.error, HasSubstr("interrupted"));
  EXPECT_EQ(std::stoi(folder_.read("code")), 1);
  EXPECT_LT(std::stod(folder_.read("took_ms")), 8000.0);  // 3 s, and a busy machine
}

TEST_F(OnTheWire, RefusesToEmulateWhatOthersCouldSee) {
  std::string rig = small_wire_rig();
  const std::string id = "id = \"127.0.0.1\"";
  rig.replace(rig.find(id), id.size(), "id = \"192.168.1.50\"");
  folder_.write("rig.toml", rig);
  const Ended ended =
      GonioProcess({"rig.toml", "--", "true"}, folder_.path(), 0, GONIO_EMULATE).wait();
  EXPECT_EQ(ended.exit_code, 2);
  EXPECT_THAT(ended.error, HasSubstr("begins with 127."));
}

TEST_F(OnTheWire, RefusesFaultsThatADeviceCannotShow) {
  const auto refused = [&](const char* option, const char* value, const char* says) {
    const Ended ended =
        GonioProcess({"rig.toml", option, value, "--", "true"}, folder_.path(), 0, GONIO_EMULATE)
            .wait();
    EXPECT_EQ(ended.exit_code, 2) << value;
    EXPECT_THAT(ended.error, HasSubstr(says));
  };
  refused("--fault", "lost_packets@lamp_arm", "alarm");  // what it can show instead
  refused("--fault", "crc_error@lamp", "late_reply");    // on TCP
  refused("--fault", "stall@camera", "no_frame");
  refused("--fault", "stall@cam", "no device");
  refused("--time-scale", "nan", "finite");
}

TEST_F(OnTheWire, LeavesNoFolderBehindHoweverItEnds) {
  for (const int signal : {0, SIGTERM, SIGQUIT, SIGKILL}) {
    GonioProcess emulator({"rig.toml", "--", "sh", "-c",
                           "printf %s \"$UMOCKDEV_DIR\" >folder; echo ready >&2; exec sleep " +
                               std::string(signal == 0 ? "0" : "300")},
                          folder_.path(), 0, GONIO_EMULATE);
    ASSERT_TRUE(emulator.wait_for("ready"));
    const std::filesystem::path machine = folder_.read("folder");
    ASSERT_FALSE(machine.empty());
    if (signal != 0) {
      EXPECT_TRUE(std::filesystem::exists(machine));
      emulator.send(signal);
    }
    emulator.wait();
    // Where it was killed another process removes it, a moment later.
    const auto patience = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (std::filesystem::exists(machine) && std::chrono::steady_clock::now() < patience) {
      std::this_thread::yield();
    }
    EXPECT_FALSE(std::filesystem::exists(machine)) << signal;
  }
}

// The first files that are opened would get their numbers.
TEST_F(OnTheWire, ClosedStandardStreamsAreNotTakenForDevices) {
  folder_.write("closed.sh", std::string("gonio=\"") + GONIO_PROGRAM + R"("
"$gonio" home rig.toml <&- 2>&-
)");
  EXPECT_EQ(in_the_machine("closed.sh").exit_code, 0);
  const std::string command =
      "exec \"$0\" rig.toml --time-scale 4 -- \"$1\" home rig.toml <&- 2>&-";
  EXPECT_EQ(
      GonioProcess({"-c", command, GONIO_EMULATE, GONIO_PROGRAM}, folder_.path(), 0, "/bin/sh")
          .wait()
          .exit_code,
      0);
}

TEST_F(OnTheWire, PassesOnTheCommandsExitCode) {
  const auto code = [&](const std::string& script) {
    return GonioProcess({"rig.toml", "--", "sh", "-c", script}, folder_.path(), 0, GONIO_EMULATE)
        .wait()
        .exit_code;
  };
  EXPECT_EQ(code("exit 7"), 7);
  EXPECT_EQ(code("kill -TERM $$"), 128 + SIGTERM);
}

}  // namespace
}  // namespace gonio
