// What goes wrong on USB and in the drive behind it: each has its error, within its deadline, and
// none ends as a good reading.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "throws_device_error.h"
#include "usb_rig.h"

namespace gonio::contracts {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;
using testing::AllOf;
using testing::HasSubstr;
using testing::Property;
using testing::Throws;
using namespace gonio::literals;
using namespace std::chrono_literals;
using Wall = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kPatience{300000};  // the world's
// Three questions of 250 ms, and what lies between them on a busy machine.
constexpr std::chrono::milliseconds kQuestionDeadline{3000};

auto says(DeviceErrc code, const std::string& words) {
  return Throws<DeviceError>(AllOf(Property("code", &DeviceError::code, code),
                                   Property("what", &DeviceError::what, HasSubstr(words))));
}

template <class Act>
std::chrono::milliseconds time_of(Act act) {
  const Wall::time_point start = Wall::now();
  act();
  return std::chrono::duration_cast<std::chrono::milliseconds>(Wall::now() - start);
}

/// A stage that is homed and stands 80 deg from there.
class UsbStageFaults : public testing::Test {
 protected:
  UsbStageFaults() : stage_(rig_.open_stage()) {
    stage_->home(kPatience);
    stage_->begin_move_to(far_);
    stage_->wait_until_settled(kPatience);
  }

  void expect_works() {
    stage_->begin_move_to(far_);
    EXPECT_NEAR(stage_->wait_until_settled(kPatience).degrees(), far_.degrees(), 0.01);
  }

  void move_there_and_wait() {
    stage_->begin_move_to(near_);
    stage_->wait_until_settled(kPatience);
  }

  UsbRig rig_;
  Angle far_ = rig_.axis().home + 80.0_deg;
  Angle near_ = rig_.axis().home + 20.0_deg;
  std::shared_ptr<apt_stage::AptStage> stage_;
};

TEST_F(UsbStageFaults, DeadLinkTimesOut) {
  rig_.add_fault("dead_link@azimuth");
  EXPECT_LT(time_of([&] {
              EXPECT_THAT([&] { move_there_and_wait(); }, ThrowsDeviceError(DeviceErrc::Timeout));
            }),
            kQuestionDeadline);
  EXPECT_LT(time_of([&] {
              EXPECT_THAT([&] { stage_->home(kPatience); }, ThrowsDeviceError(DeviceErrc::Timeout));
            }),
            kQuestionDeadline);
}

TEST_F(UsbStageFaults, StopReturnsWithinOneTransferOnADeadLink) {
  rig_.add_fault("dead_link@azimuth");
  std::thread waits([&] {
    EXPECT_THAT([&] { move_there_and_wait(); },
                testing::AnyOf(ThrowsDeviceError(DeviceErrc::Timeout),
                               ThrowsDeviceError(DeviceErrc::Stopped)));
  });
  // A transfer has 300 ms, the question and its repetitions 750.
  EXPECT_LT(time_of([&] { stage_->stop(); }), 700ms);
  waits.join();
}

TEST_F(UsbStageFaults, MoveThatWasNotHeardTimesOut) {
  // APT moves are not answered: that one was lost shows only in the questions after it.
  rig_.add_fault("lost_move@azimuth:count=1");
  stage_->begin_move_to(near_);
  EXPECT_THAT([&] { stage_->wait_until_settled(kPatience); },
              says(DeviceErrc::Timeout, "not moving, reported as completed"));
  expect_works();
}

TEST_F(UsbStageFaults, UnansweredQuestionIsAskedAgain) {
  rig_.add_fault("dead_link@azimuth:count=2");
  expect_works();
}

TEST_F(UsbStageFaults, TornAnswerIsAskedForAgainAndThenABrokenProtocol) {
  rig_.add_fault("torn_reply@azimuth:count=2");
  expect_works();
  rig_.add_fault("torn_reply@azimuth");
  EXPECT_LT(time_of([&] {
              EXPECT_THAT([&] { move_there_and_wait(); }, ThrowsDeviceError(DeviceErrc::Protocol));
            }),
            kQuestionDeadline);
}

TEST_F(UsbStageFaults, StalledEndpointIsClearedAndThenABrokenProtocol) {
  rig_.add_fault("stall@azimuth:count=2");
  expect_works();
  rig_.add_fault("stall@azimuth");
  EXPECT_LT(time_of([&] {
              EXPECT_THAT([&] { move_there_and_wait(); }, says(DeviceErrc::Protocol, "stalled"));
            }),
            kQuestionDeadline);
}

TEST_F(UsbStageFaults, UnpluggedDuringAMoveItIsNotHomedUntilItIsBackAndHomed) {
  stage_->begin_move_to(near_);
  rig_.bed.unplug(UsbRig::kStageName);
  EXPECT_LT(time_of([&] {
              EXPECT_THAT([&] { stage_->wait_until_settled(kPatience); },
                          says(DeviceErrc::Disconnected, "unplugged"));
            }),
            1s);
  EXPECT_THAT([&] { stage_->begin_move_to(near_); }, ThrowsDeviceError(DeviceErrc::NotHomed));
  EXPECT_THAT([&] { stage_->wait_until_settled(kPatience); },
              ThrowsDeviceError(DeviceErrc::NotHomed));
  EXPECT_LT(time_of([&] {
              EXPECT_THAT([&] { stage_->home(kPatience); },
                          says(DeviceErrc::Disconnected, "not found"));
            }),
            apt_stage::AptStage::kReconnect + 1s);
  rig_.bed.plug_in(UsbRig::kStageName);
  EXPECT_THAT([&] { stage_->begin_move_to(near_); }, ThrowsDeviceError(DeviceErrc::NotHomed));
  stage_->home(kPatience);
  expect_works();
}

TEST_F(UsbStageFaults, HomeWaitsForAPlugThatComesBack) {
  const double now_s = devices::to_seconds(rig_.world.clock().now());
  rig_.add_fault("unplug@azimuth:for_s=20,after_s=" + std::to_string(now_s));  // 0.8 s
  EXPECT_THAT([&] { move_there_and_wait(); }, ThrowsDeviceError(DeviceErrc::Disconnected));
  stage_->home(kPatience);
  expect_works();
}

TEST_F(UsbStageFaults, StopOfAnUnpluggedStageIsSafe) {
  rig_.bed.unplug(UsbRig::kStageName);
  EXPECT_LT(time_of([&] { stage_->stop(); }), 1s);  // looking for it anew takes longer
  EXPECT_THAT([&] { stage_->home(kPatience); }, ThrowsDeviceError(DeviceErrc::Stopped));
  rig_.bed.plug_in(UsbRig::kStageName);
  stage_->rearm();
  EXPECT_THAT([&] { stage_->begin_move_to(near_); }, ThrowsDeviceError(DeviceErrc::NotHomed));
  stage_->home(kPatience);
  expect_works();
}

TEST_F(UsbStageFaults, UnitThatSaysItIsHomedIsTakenOver) {
  stage_.reset();
  stage_ = rig_.open_stage();
  EXPECT_NEAR(stage_->wait_until_settled(kPatience).degrees(), far_.degrees(), 0.01);
  move_there_and_wait();
}

// The unit counts its unacknowledged messages over all of them, and falls silent after 50.
TEST_F(UsbStageFaults, ManyShortPrograms) {
  stage_.reset();
  const auto port = UsbRig::open_port();
  for (int program = 0; program < 60; ++program) {
    const auto stage = rig_.stage_on(port);
    ASSERT_NEAR(stage->wait_until_settled(kPatience).degrees(), far_.degrees(), 0.01) << program;
  }
}

TEST_F(UsbStageFaults, HomedItStaysWithinItsLimitsOnTheWayHome) {
  stage_->begin_move_to(rig_.axis().home - 20.0_deg);
  stage_->wait_until_settled(kPatience);
  stage_->home(kPatience);
  EXPECT_NEAR(rig_.world.joint(UsbRig::kAxis).encoder(rig_.world.clock().now()).degrees(),
              rig_.axis().home.degrees(), 0.01);
  expect_works();
}

TEST_F(UsbStageFaults, NotHomedBehindItsMarkItTurnsTheLongWay) {
  stage_->begin_move_to(rig_.axis().home - 20.0_deg);
  stage_->wait_until_settled(kPatience);
  rig_.bed.cycle_power(UsbRig::kStageName);
  EXPECT_THAT([&] { stage_->wait_until_settled(kPatience); },
              ThrowsDeviceError(DeviceErrc::NotHomed));
  stage_->home(kPatience);
  EXPECT_NEAR(rig_.world.joint(UsbRig::kAxis).encoder(rig_.world.clock().now()).degrees(),
              rig_.axis().home.degrees() - 360.0, 0.05);
  expect_works();
}

TEST_F(UsbStageFaults, UnitThatWasSwitchedOffIsNotTakenOver) {
  stage_.reset();
  rig_.bed.cycle_power(UsbRig::kStageName);
  stage_ = rig_.open_stage();
  EXPECT_THAT([&] { move_there_and_wait(); }, says(DeviceErrc::NotHomed, "home"));
}

TEST_F(UsbStageFaults, PowerThatFailedMeansNotHomed) {
  rig_.bed.cycle_power(UsbRig::kStageName);
  EXPECT_THAT([&] { stage_->begin_move_to(near_); }, ThrowsDeviceError(DeviceErrc::NotHomed));
  EXPECT_THAT([&] { stage_->wait_until_settled(kPatience); },
              ThrowsDeviceError(DeviceErrc::NotHomed));
  stage_->home(kPatience);
  expect_works();
}

TEST_F(UsbStageFaults, AlarmIsAFaultUntilThePowerIsCycled) {
  rig_.add_fault("alarm@azimuth:count=1");
  EXPECT_THAT([&] { move_there_and_wait(); }, says(DeviceErrc::Fault, "overload"));
  EXPECT_THAT([&] { stage_->begin_move_to(far_); }, ThrowsDeviceError(DeviceErrc::Fault));
  EXPECT_THAT([&] { stage_->home(kPatience); }, ThrowsDeviceError(DeviceErrc::Fault));
  stage_->stop();
  EXPECT_THAT([&] { stage_->rearm(); }, ThrowsDeviceError(DeviceErrc::Fault));
  rig_.bed.cycle_power(UsbRig::kStageName);
  stage_->rearm();
  stage_->home(kPatience);
  expect_works();
}

TEST_F(UsbStageFaults, LimitSwitchIsAFaultUntilHomed) {
  rig_.add_fault("limit_switch@azimuth:count=1");
  EXPECT_THAT([&] { move_there_and_wait(); }, says(DeviceErrc::Fault, "limit switch"));
  stage_->stop();
  stage_->rearm();  // as a session does: a switch is driven off by homing only
  EXPECT_THAT([&] { stage_->begin_move_to(far_); }, ThrowsDeviceError(DeviceErrc::Fault));
  stage_->home(kPatience);
  expect_works();
}

TEST_F(UsbStageFaults, NeverInPositionTimesOutAndSaysWhy) {
  rig_.add_fault("never_in_position@azimuth:count=1");
  stage_->begin_move_to(near_);
  EXPECT_THAT([&] { stage_->wait_until_settled(20s); },
              says(DeviceErrc::Timeout, "still moving, not reported as completed"));
  expect_works();
}

TEST_F(UsbStageFaults, IgnoredStopIsAFault) {
  rig_.add_fault("stop_ignored@azimuth");
  rig_.add_fault("never_in_position@azimuth");  // however late it is asked, it is still on its way
  stage_->begin_move_to(near_);
  stage_->stop();
  EXPECT_THAT([&] { stage_->rearm(); }, says(DeviceErrc::Fault, "ignored stop"));
  EXPECT_THAT([&] { stage_->begin_move_to(far_); }, ThrowsDeviceError(DeviceErrc::Stopped));
}

TEST_F(UsbStageFaults, HeldByAnotherItIsBusy) {
  EXPECT_THAT([&] { rig_.open_stage(); }, says(DeviceErrc::Disconnected, "busy"));
  stage_.reset();
  EXPECT_NO_THROW(rig_.open_stage());
}

TEST(UsbEnumeration, DeviceThatWasLetGoOfIsFreeAndIsFoundAgain) {
  UsbRig rig;
  const auto device = usb_bus::open_usb_device("azimuth", UsbRig::stage_address());
  device->disconnect();
  EXPECT_FALSE(device->connected());
  {
    const auto other = rig.open_stage();
    EXPECT_THAT([&] { device->reconnect(0ms); }, says(DeviceErrc::Disconnected, "busy"));
  }
  device->reconnect(0ms);
  EXPECT_TRUE(device->connected());
}

TEST(UsbEnumeration, ListsWhatIsPluggedInAndFindsBySerial) {
  UsbRig rig;
  const auto found = usb_bus::list_usb_devices();
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(usb_bus::to_string_of_id(found[0].vendor, found[0].product), "0403:faf0");
  EXPECT_EQ(found[0].serial, UsbRig::kStageSerial);
  EXPECT_EQ(found[0].description, "Kinesis K10CR1 Rotary Stage");
  EXPECT_FALSE(found[0].is_instrument);
  EXPECT_EQ(found[1].serial, UsbRig::kMeterSerial);
  EXPECT_EQ(found[1].manufacturer, "Thorlabs");
  EXPECT_TRUE(found[1].is_instrument);

  usb_bus::UsbAddress other = UsbRig::stage_address();
  other.serial = "55999999";
  EXPECT_THAT([&] { usb_bus::open_usb_device("azimuth", other); },
              says(DeviceErrc::Disconnected, UsbRig::kStageSerial));

  rig.bed.unplug(UsbRig::kMeterName);
  EXPECT_EQ(usb_bus::list_usb_devices().size(), 1u);
  rig.bed.plug_in(UsbRig::kMeterName);
  EXPECT_EQ(usb_bus::list_usb_devices().size(), 2u);
}

TEST(UsbEnumeration, StageAndMeterTellWhoTheyAre) {
  UsbRig rig;
  const auto stage = rig.open_stage();
  EXPECT_EQ(stage->identity().model, "K10CR1");
  EXPECT_EQ(std::to_string(stage->identity().serial), UsbRig::kStageSerial);
  EXPECT_EQ(stage->identity().firmware, "1.0.3");
  const auto meter = UsbRig::open_meter();
  EXPECT_EQ(meter->identity().model, "PM100D");
  EXPECT_EQ(meter->identity().serial, UsbRig::kMeterSerial);
}

class UsbMeterFaults : public testing::Test {
 protected:
  UsbMeterFaults() : meter_(UsbRig::open_meter({"MEAS:POW?", 0.0, 150ms})) {
    rig_.world.light_source().light("G");
  }

  UsbRig rig_;
  std::shared_ptr<usbtmc_monitor::UsbtmcMonitor> meter_;
};

TEST_F(UsbMeterFaults, UnansweredQueryIsAskedAgainAndThenTimesOut) {
  rig_.add_fault("dead_link@monitor:count=2");
  EXPECT_NEAR(meter_->read(), 1.0, 0.05);
  rig_.add_fault("dead_link@monitor");
  EXPECT_LT(time_of([&] {
              EXPECT_THAT([&] { meter_->read(); }, ThrowsDeviceError(DeviceErrc::Timeout));
            }),
            kQuestionDeadline);
}

TEST_F(UsbMeterFaults, TornAnswerIsAskedForAgainAndThenABrokenProtocol) {
  rig_.add_fault("torn_reply@monitor:count=2");
  EXPECT_NEAR(meter_->read(), 1.0, 0.05);
  rig_.add_fault("torn_reply@monitor");
  EXPECT_THAT([&] { meter_->read(); }, says(DeviceErrc::Protocol, "broke off"));
}

TEST_F(UsbMeterFaults, StalledEndpointIsClearedAndThenABrokenProtocol) {
  rig_.add_fault("stall@monitor:count=2");
  EXPECT_NEAR(meter_->read(), 1.0, 0.05);
  rig_.add_fault("stall@monitor");
  EXPECT_THAT([&] { meter_->read(); }, says(DeviceErrc::Protocol, "stalled"));
}

TEST_F(UsbMeterFaults, UnpluggedItIsFoundAgainAtTheNextReading) {
  rig_.bed.unplug(UsbRig::kMeterName);
  EXPECT_THAT([&] { meter_->read(); }, ThrowsDeviceError(DeviceErrc::Disconnected));
  rig_.bed.plug_in(UsbRig::kMeterName);
  EXPECT_NEAR(meter_->read(), 1.0, 0.05);
}

TEST_F(UsbMeterFaults, UnknownCommandIsAFaultInTheInstrumentsWords) {
  meter_.reset();
  const auto wrong = UsbRig::open_meter({"MEAS:VOLT?", 0.0, 150ms});
  EXPECT_THAT([&] { wrong->read(); }, says(DeviceErrc::Fault, "Undefined header"));
}

TEST_F(UsbMeterFaults, ZeroIsTakenOff) {
  meter_.reset();
  const auto shifted = UsbRig::open_meter({"MEAS:POW?", 0.25, 150ms});
  EXPECT_NEAR(shifted->read(), 0.75, 0.05);
}

}  // namespace
}  // namespace gonio::contracts
