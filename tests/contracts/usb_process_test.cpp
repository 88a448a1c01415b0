// The emulated machine as other programs see it.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <string>
#include <thread>
#include <vector>

#include "usb_rig.h"

extern char** environ;

namespace gonio::contracts {
namespace {

using testing::HasSubstr;
using namespace std::chrono_literals;

/// A running usb_probe with its input and output.
class Probe {
 public:
  Probe(const usb_emulator::UsbTestbed& bed, std::vector<std::string> arguments) {
    std::vector<std::string> environment;
    for (char** variable = environ; *variable != nullptr; ++variable) {
      const std::string text(*variable);
      if (!text.starts_with("ASAN_OPTIONS=")) environment.push_back(text);
    }
    for (const auto& [name, value] : bed.environment()) environment.push_back(name + "=" + value);
    // A sanitizer's library wants to be first, where the emulated machine is.
    environment.emplace_back("ASAN_OPTIONS=verify_asan_link_order=0");
    arguments.insert(arguments.begin(), GONIO_USB_PROBE);

    std::array<int, 2> in{};
    std::array<int, 2> out{};
    EXPECT_EQ(pipe2(in.data(), O_CLOEXEC) + pipe2(out.data(), O_CLOEXEC), 0);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in[0], STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out[1], STDOUT_FILENO);
    const auto pointers = [](std::vector<std::string>& texts) {
      std::vector<char*> list;
      for (std::string& text : texts) list.push_back(text.data());
      list.push_back(nullptr);
      return list;
    };
    EXPECT_EQ(posix_spawn(&process_, GONIO_USB_PROBE, &actions, nullptr, pointers(arguments).data(),
                          pointers(environment).data()),
              0);
    posix_spawn_file_actions_destroy(&actions);
    close(in[0]);
    close(out[1]);
    input_ = in[1];
    output_ = out[0];
  }
  ~Probe() {
    end();
    close(output_);
  }
  Probe(const Probe&) = delete;
  Probe& operator=(const Probe&) = delete;

  std::string line() const {
    std::string text;
    for (char letter = 0; read(output_, &letter, 1) == 1 && letter != '\n';) text.push_back(letter);
    return text;
  }
  void kill_it() const { kill(process_, SIGKILL); }

  /// Ends its input, waits for it and returns its exit code, or minus the signal that ended it.
  int end() {
    if (input_ >= 0) {
      close(input_);
      input_ = -1;
      int status = 0;
      waitpid(process_, &status, 0);
      code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    }
    return code_;
  }

 private:
  pid_t process_ = 0;
  int input_ = -1;
  int output_ = -1;
  int code_ = 0;
};

TEST(UsbProcess, ListsTheEmulatedDevices) {
  const UsbRig rig;
  Probe probe(rig.bed, {"list"});
  EXPECT_EQ(probe.line(), std::string("0403:faf0 ") + UsbRig::kStageSerial);
  EXPECT_EQ(probe.line(), std::string("1313:8078 ") + UsbRig::kMeterSerial);
  EXPECT_EQ(probe.end(), 0);
}

TEST(UsbProcess, OpensAgainAndAgain) {
  const UsbRig rig;
  for (int process = 0; process < 2; ++process) {
    Probe probe(rig.bed, {"open", UsbRig::kStageSerial, "10"});
    EXPECT_EQ(probe.line(), "opened 10");
    EXPECT_EQ(probe.end(), 0);
  }
}

TEST(UsbProcess, SecondProcessIsRefusedWhileTheFirstHoldsTheDevice) {
  const UsbRig rig;
  Probe first(rig.bed, {"hold", UsbRig::kStageSerial});
  ASSERT_EQ(first.line(), "held");
  Probe second(rig.bed, {"open", UsbRig::kStageSerial, "1"});
  EXPECT_THAT(second.line(), HasSubstr("busy"));
  EXPECT_EQ(second.end(), 1);
  EXPECT_EQ(first.end(), 0);
  Probe third(rig.bed, {"open", UsbRig::kStageSerial, "1"});
  EXPECT_EQ(third.line(), "opened 1");
}

TEST(UsbProcess, KilledProcessHoldsNothing) {
  const UsbRig rig;
  Probe first(rig.bed, {"hold", UsbRig::kStageSerial});
  ASSERT_EQ(first.line(), "held");
  first.kill_it();
  EXPECT_EQ(first.end(), -SIGKILL);
  Probe second(rig.bed, {"open", UsbRig::kStageSerial, "1"});
  EXPECT_EQ(second.line(), "opened 1");
}

// A call of the killed program is under way almost always; a few kills make it certain.
TEST(UsbProcess, ProcessKilledWithinACallHoldsNothing) {
  const UsbRig rig;
  for (int time = 0; time < 10; ++time) {
    Probe first(rig.bed, {"read", UsbRig::kStageSerial});
    ASSERT_EQ(first.line(), "reading");
    first.kill_it();
    EXPECT_EQ(first.end(), -SIGKILL);
    Probe second(rig.bed, {"open", UsbRig::kStageSerial, "1"});
    EXPECT_EQ(second.line(), "opened 1");
  }
}

TEST(UsbProcess, StageCanBeHomedAfterItsMasterWasKilled) {
  UsbRig rig;
  Probe first(rig.bed, {"hold", UsbRig::kStageSerial});
  ASSERT_EQ(first.line(), "held");
  first.kill_it();
  first.end();
  const auto stage = rig.open_stage();
  EXPECT_NO_THROW(stage->home(5min));
}

TEST(UsbProcess, SerialPortIsTheTerminalBehindIt) {
  UsbRig rig;
  const int master = posix_openpt(O_RDWR | O_NOCTTY);
  ASSERT_GE(master, 0);
  ASSERT_EQ(grantpt(master) + unlockpt(master), 0);
  const std::string terminal = ptsname(master);
  const int kept = open(terminal.c_str(), O_RDWR | O_NOCTTY);
  rig.bed.add_serial_port("/dev/ttyUSB0", terminal);

  Probe probe(rig.bed, {"talk", "/dev/ttyUSB0"});
  std::string heard;
  for (char letter = 0; heard.size() < 4 && read(master, &letter, 1) == 1;) heard.push_back(letter);
  EXPECT_EQ(heard, "ping");
  termios line{};
  EXPECT_EQ(tcgetattr(kept, &line), 0);
  EXPECT_EQ(cfgetospeed(&line), B115200);  // the settings reached the real terminal
  EXPECT_EQ(write(master, "pong", 4), 4);
  EXPECT_EQ(probe.line(), "pong");
  EXPECT_EQ(probe.end(), 0);
  close(kept);
  close(master);
}

}  // namespace
}  // namespace gonio::contracts
