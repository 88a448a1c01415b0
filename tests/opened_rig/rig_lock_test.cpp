// Two processes never drive one rig.

#include "gonio/opened_rig/rig_lock.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <future>

#include "gonio/console/failures.h"
#include "gonio/files/text_file.h"
#include "temporary_folder.h"

namespace gonio::cli {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

RigFile rig_of(const std::string& name) {
  const std::string place = std::string(GONIO_RIGS) + "/" + name;
  return rig_file_from_text(files::read_text_file(place, 1 << 20), place);
}

/// Another process, that holds a rig until it is told to end or is killed.
class OtherProcess {
 public:
  enum class Leaves { nobody, a_watchdog };

  OtherProcess(const RigFile& rig, const std::filesystem::path& folder, Leaves leaves) {
    std::array<int, 2> says{};
    EXPECT_EQ(::pipe2(says.data(), O_CLOEXEC), 0);
    EXPECT_EQ(::pipe2(watchdog_.data(), O_CLOEXEC), 0);
    pid_ = ::fork();
    if (pid_ == 0) {
      const RigLock lock(rig, Parts::all, folder);
      if (leaves == Leaves::a_watchdog && ::fork() == 0) {
        // Holds what it has inherited until the test closes its end.
        ::close(watchdog_[1]);
        char none = 0;
        [[maybe_unused]] const ssize_t end = ::read(watchdog_[0], &none, 1);
        ::_exit(0);
      }
      [[maybe_unused]] const ssize_t written = ::write(says[1], "h", 1);
      while (true) ::pause();
    }
    ::close(watchdog_[0]);
    char held = 0;
    EXPECT_EQ(::read(says[0], &held, 1), 1);
    ::close(says[0]);
    ::close(says[1]);
  }
  ~OtherProcess() {
    kill();
    end_watchdog();
  }
  OtherProcess(const OtherProcess&) = delete;
  OtherProcess& operator=(const OtherProcess&) = delete;

  pid_t pid() const { return pid_; }
  void kill() {
    if (ended_) return;
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
    ended_ = true;
  }
  void end_watchdog() {
    if (watchdog_[1] >= 0) ::close(watchdog_[1]);
    watchdog_[1] = -1;
  }

 private:
  pid_t pid_ = -1;
  bool ended_ = false;
  std::array<int, 2> watchdog_{-1, -1};
};

/// Shares no device with a rig of rigs/.
RigFile rig_elsewhere() {
  RigFile rig = rig_of("wire.toml");
  rig.rig.name = "another";
  for (BusEntry& bus : rig.devices.buses) {
    bus.host = "192.0.2.1";
    bus.port = "/nowhere/tty9";
  }
  for (AxisDevice& axis : rig.devices.axes) axis.serial += "9";
  rig.devices.camera.id = "192.0.2.2";
  rig.devices.monitor.serial += "9";
  return rig;
}

class RigLockTest : public testing::Test {
 protected:
  void expect_refused(const RigFile& rig, const OtherProcess& by, const std::string& device) {
    EXPECT_THAT([&] { RigLock(rig, Parts::all, folder_.path()); },
                ThrowsMessage<UsageError>(
                    HasSubstr(device + " is used by process " + std::to_string(by.pid()))));
  }

  TemporaryFolder folder_;
};

TEST_F(RigLockTest, RefusesASecondProcessAndIsFreeOnceTheFirstIsKilled) {
  const RigFile rig = rig_of("wire.toml");
  OtherProcess other(rig, folder_.path(), OtherProcess::Leaves::nobody);
  EXPECT_THROW(RigLock(rig, Parts::all, folder_.path()), UsageError);
  other.kill();
  EXPECT_NO_THROW(RigLock(rig, Parts::all, folder_.path()));
}

TEST_F(RigLockTest, CountsEveryDeviceWhateverTheRigFileCallsTheRig) {
  const RigFile first = rig_of("uncalibrated_wire.toml");
  ASSERT_FALSE(first.devices.changer.bus.empty());
  const OtherProcess other(first, folder_.path(), OtherProcess::Leaves::nobody);
  const RigFile another = rig_elsewhere();
  EXPECT_NO_THROW(RigLock(another, Parts::all, folder_.path()));

  RigFile shares = another;
  shares.devices.camera.id = first.devices.camera.id;
  expect_refused(shares, other, "camera " + first.devices.camera.id);
  EXPECT_NO_THROW(RigLock(shares, Parts::axes_and_lamp, folder_.path())) << "that does without";

  shares = another;
  shares.devices.axes.back().serial = first.devices.axes.back().serial;
  expect_refused(shares, other, "stage " + first.devices.axes.back().serial);

  shares = another;
  shares.devices.monitor.serial = first.devices.monitor.serial;
  expect_refused(shares, other, "monitor " + first.devices.monitor.serial);

  for (const std::string& name : {first.devices.lamp.bus, first.devices.axes.front().bus}) {
    shares = another;
    BusEntry bus = *first.devices.bus(name);
    bus.name = shares.devices.lamp.bus;
    for (BusEntry& each : shares.devices.buses) {
      if (each.name == bus.name) each = bus;
    }
    EXPECT_THROW(RigLock(shares, Parts::all, folder_.path()), UsageError) << name;
  }
}

TEST_F(RigLockTest, CountsTheChangersBus) {
  RigFile first = rig_of("uncalibrated_wire.toml");
  BusEntry own = *first.devices.bus(first.devices.changer.bus);
  own.name = "changer";
  own.kind = BusEntry::Kind::modbus_tcp;
  own.host = "192.0.2.7";
  first.devices.buses.push_back(own);
  first.devices.changer.bus = own.name;
  const OtherProcess other(first, folder_.path(), OtherProcess::Leaves::nobody);
  RigFile shares = rig_elsewhere();
  EXPECT_NO_THROW(RigLock(shares, Parts::all, folder_.path()));
  shares.devices.buses.push_back(own);
  shares.devices.changer.bus = own.name;
  expect_refused(shares, other, "192.0.2.7:" + std::to_string(own.tcp_port));
}

TEST_F(RigLockTest, IsHeldByTheWatchdogOfADeadProcessUntilTheRigIsStopped) {
  const RigFile rig = rig_of("wire.toml");
  OtherProcess other(rig, folder_.path(), OtherProcess::Leaves::a_watchdog);
  other.kill();
  auto next = std::async(std::launch::async, [&] { RigLock(rig, Parts::all, folder_.path()); });
  const std::filesystem::path any = std::filesystem::directory_iterator(folder_.path())->path();
  EXPECT_EQ(files::lock_holder(any), other.pid());
  // Who does not wait is refused within 50 ms.
  EXPECT_EQ(next.wait_for(std::chrono::milliseconds(300)), std::future_status::timeout);
  other.end_watchdog();
  EXPECT_NO_THROW(next.get());
}

}  // namespace
}  // namespace gonio::cli
