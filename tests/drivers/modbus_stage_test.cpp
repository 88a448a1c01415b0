// The stage's state machine over a bus that remembers. tests/contracts has it on the wire.

#include "gonio/modbus_stage/modbus_stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "fake_modbus_bus.h"
#include "gonio/devices/steady_clock.h"
#include "some_drive.h"

namespace gonio::modbus_stage {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;
using modbus_bus::FakeBus;
using modbus_bus::Request;
using namespace std::chrono_literals;
using namespace gonio::literals;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::uint16_t kStatus = 0x10;
constexpr std::uint16_t kPosition = 0x12;
constexpr std::uint16_t kAlarm = 0x14;
constexpr std::uint16_t kLimits = 0x15;
constexpr std::uint16_t kFollowing = 0x16;
constexpr std::uint16_t kMove = 0x20;
constexpr std::uint16_t kCommand = 0x30;
constexpr std::uint16_t kResolution = 0x40;

constexpr unsigned kFault = 1U << 0U;
constexpr unsigned kEnabled = 1U << 1U;
constexpr unsigned kMoving = 1U << 2U;
constexpr unsigned kDone = (1U << 3U) | (1U << 4U);
constexpr unsigned kHomed = 1U << 5U;

/// A drive that is wherever it is sent as soon as it is asked.
class ModbusStageTest : public testing::Test {
 protected:
  ModbusStageTest() {
    status(kEnabled);
    bus_->registers[kResolution] = 10000;
    bus_->on_write = [this](const Request& request) {
      if (request.address == kMove) {
        bus_->registers[kPosition] = request.words[0];
        bus_->registers[kPosition + 1] = request.words[1];
        status(kEnabled | kDone | kHomed);
      } else if (request.words[0] == 2) {
        position(0);
        status(kEnabled | kDone | kHomed);
      } else if (request.words[0] == 1) {
        status(kEnabled);
      }
    };
  }

  void status(unsigned bits) { bus_->registers[kStatus] = static_cast<std::uint16_t>(bits); }
  void position(std::int32_t steps) {
    const auto bits = static_cast<std::uint32_t>(steps);
    bus_->registers[kPosition] = static_cast<std::uint16_t>(bits >> 16U);
    bus_->registers[kPosition + 1] = static_cast<std::uint16_t>(bits & 0xFFFFU);
  }

  std::unique_ptr<ModbusStage> make(DriveProfile profile = some_drive(), DriveScale scale = {100.0},
                                    std::vector<std::string> confirmed = {}) {
    const devices::AxisSetup setup{"tilt", {-90.0_deg, 90.0_deg}, 10.0_deg, 20.0, 30.0, 100ms};
    StageOptions options;
    options.confirmed = std::move(confirmed);
    options.poll_interval = 1ms;
    options.arrival_patience = 20ms;
    return std::make_unique<ModbusStage>(bus_, 5, setup, std::move(profile), scale, clock_,
                                         std::move(options));
  }

  std::unique_ptr<ModbusStage> homed(DriveProfile profile = some_drive(),
                                     DriveScale scale = {100.0}) {
    auto stage = make(std::move(profile), scale);
    stage->home(kPatience);
    bus_->writes.clear();
    return stage;
  }

  template <class Action>
  static void expect_error(DeviceErrc code, const std::string& text, Action action) {
    try {
      action();
      ADD_FAILURE() << "expected " << text;
    } catch (const DeviceError& error) {
      EXPECT_EQ(error.code(), code) << error.what();
      EXPECT_THAT(error.what(), HasSubstr(text));
      EXPECT_EQ(error.device(), "tilt");
    }
  }

  static constexpr std::chrono::milliseconds kPatience{100000};  // of the session
  std::shared_ptr<FakeBus> bus_ = std::make_shared<FakeBus>();
  devices::SteadyClock clock_{100.0};
};

TEST_F(ModbusStageTest, SendsTargetHighWordFirstWithItsPace) {
  const auto stage = homed();
  stage->begin_move_to(0.0_deg);  // 10 deg below the home mark: -1000 steps
  ASSERT_EQ(bus_->writes.size(), 1U);
  EXPECT_EQ(bus_->writes[0].request.address, kMove);
  EXPECT_THAT(bus_->writes[0].request.words, ElementsAre(0xFFFF, 0xFC18, 2000, 3000, 3000, 0x10));
  EXPECT_FALSE(bus_->writes[0].repeatable);  // by the bus; the stage asks the drive in between
  EXPECT_NEAR(stage->wait_until_settled(kPatience).degrees(), 0.0, 1e-9);
}

TEST_F(ModbusStageTest, ReversedDriveCountsTheOtherWay) {
  const auto stage = homed(some_drive(), {100.0, true});
  stage->begin_move_to(0.0_deg);
  EXPECT_EQ(bus_->writes[0].request.words[1], 1000);
  EXPECT_NEAR(stage->wait_until_settled(kPatience).degrees(), 0.0, 1e-9);
}

TEST_F(ModbusStageTest, ReturnsTheFeedbackAndNotTheTarget) {
  const auto stage = homed();
  stage->begin_move_to(20.0_deg);
  position(1001);
  EXPECT_NEAR(stage->wait_until_settled(kPatience).degrees(), 20.01, 1e-9);
}

TEST_F(ModbusStageTest, WaitsForTheSettlingTimeOnTheSessionsClock) {
  const auto stage = homed();
  stage->begin_move_to(20.0_deg);
  const auto before = clock_.now();
  stage->wait_until_settled(kPatience);
  EXPECT_GE(clock_.now() - before, 100ms);
}

TEST_F(ModbusStageTest, ReadsASettledAxisWithoutSettlingAgain) {
  const auto stage = homed();
  stage->begin_move_to(20.0_deg);
  stage->wait_until_settled(kPatience);
  int reads = 0;
  bus_->on_read = [&](const Request&) { ++reads; };
  // The settling time is a millisecond of the host's, which may be elsewhere that long now and
  // then.
  constexpr int kTimes = 20;
  auto shortest = devices::Clock::Duration::max();
  for (int i = 0; i < kTimes; ++i) {
    const auto before = clock_.now();
    stage->wait_until_settled(kPatience);
    shortest = std::min<devices::Clock::Duration>(shortest, clock_.now() - before);
  }
  EXPECT_LT(shortest, 100ms);
  EXPECT_EQ(reads, 2 * kTimes);  // status and position
}

TEST_F(ModbusStageTest, StopThatAnotherProcessLeftSetIsReleasedBeforeHoming) {
  bus_->registers[kCommand] = 4;
  const auto stage = make();
  stage->home(kPatience);
  ASSERT_EQ(bus_->writes.size(), 2U);
  EXPECT_EQ(bus_->writes[0].request, modbus_bus::write_register(kCommand, 0));
}

TEST_F(ModbusStageTest, StandingOffItsTargetIsATimeoutWithBothAngles) {
  const auto stage = homed();
  stage->begin_move_to(20.0_deg);
  position(990);
  expect_error(DeviceErrc::Timeout, "stands at 19.9000 deg, target 20.0000 deg",
               [&] { stage->wait_until_settled(kPatience); });
}

TEST_F(ModbusStageTest, StandingShortAndNotDoneIsAFaultThatNamesTheLimitSwitch) {
  const auto stage = homed();
  stage->begin_move_to(20.0_deg);
  position(500);
  status(kEnabled | kHomed);
  bus_->registers[kLimits] = 1;
  expect_error(DeviceErrc::Fault, "forward limit switch",
               [&] { stage->wait_until_settled(kPatience); });
}

TEST_F(ModbusStageTest, AlarmIsAFaultInTheProfilesWordsAndUnhomes) {
  const auto stage = homed();
  stage->begin_move_to(20.0_deg);
  status(kEnabled | kHomed | kFault);
  bus_->registers[kAlarm] = 3;
  expect_error(DeviceErrc::Fault, "0x03: over-temperature",
               [&] { stage->wait_until_settled(kPatience); });
  expect_error(DeviceErrc::NotHomed, "home", [&] { stage->begin_move_to(0.0_deg); });
  bus_->registers[kAlarm] = 9;
  expect_error(DeviceErrc::Fault, "0x09: see its manual", [&] { stage->rearm(); });
}

TEST_F(ModbusStageTest, FollowingErrorStopsTheAxisAndIsAFault) {
  const auto stage = homed();
  stage->begin_move_to(20.0_deg);
  status(kEnabled | kHomed | kMoving);
  bus_->registers[kFollowing] = static_cast<std::uint16_t>(-51);  // -5.1, 5.0 allowed
  expect_error(DeviceErrc::Fault, "following error -5.1",
               [&] { stage->wait_until_settled(kPatience); });
  EXPECT_THAT(bus_->writes.back().request.words, ElementsAre(4));
  EXPECT_TRUE(bus_->writes.back().urgent);
}

TEST_F(ModbusStageTest, DriveThatLostItsReferenceIsNotHomed) {
  const auto stage = homed();
  status(kEnabled | kDone);
  expect_error(DeviceErrc::NotHomed, "lost its reference",
               [&] { stage->wait_until_settled(kPatience); });
}

TEST_F(ModbusStageTest, HomingEnablesTheDriveAndIsNeverRepeated) {
  status(0);
  const auto stage = make();
  stage->home(kPatience);
  ASSERT_EQ(bus_->writes.size(), 3U);  // release, enable, home
  EXPECT_THAT(bus_->writes[1].request.words, ElementsAre(1));
  EXPECT_THAT(bus_->writes[2].request.words, ElementsAre(2));
  EXPECT_FALSE(bus_->writes[2].repeatable);
}

TEST_F(ModbusStageTest, HomingThatEndsElsewhereIsATimeoutAndStopped) {
  const auto stage = make();
  bus_->on_write = [this](const Request&) { position(700), status(kEnabled | kDone | kHomed); };
  expect_error(DeviceErrc::Timeout, "at 700 steps", [&] { stage->home(kPatience); });
  EXPECT_THAT(bus_->writes.back().request.words, ElementsAre(4));
  expect_error(DeviceErrc::NotHomed, "", [&] { stage->begin_move_to(0.0_deg); });
}

TEST_F(ModbusStageTest, StopIsUrgentAndReleasedByRearm) {
  const auto stage = homed();
  stage->stop();
  ASSERT_EQ(bus_->writes.size(), 1U);
  EXPECT_TRUE(bus_->writes[0].urgent);
  EXPECT_EQ(bus_->writes[0].request, modbus_bus::write_register(kCommand, 4));
  stage->rearm();
  ASSERT_EQ(bus_->writes.size(), 2U);
  EXPECT_EQ(bus_->writes[1].request, modbus_bus::write_register(kCommand, 0));
}

TEST_F(ModbusStageTest, AxisThatMovesOnAfterAStopIsAFaultWhereverItIsSeen) {
  const auto stage = homed();
  stage->begin_move_to(20.0_deg);
  stage->stop();
  status(kEnabled | kHomed | kMoving);
  expect_error(DeviceErrc::Fault, "moves on after a stop", [&] { stage->rearm(); });
  expect_error(DeviceErrc::Fault, "moves on after a stop", [&] { stage->state(); });
  expect_error(DeviceErrc::Stopped, "", [&] { stage->begin_move_to(0.0_deg); });
}

TEST_F(ModbusStageTest, StopThatDidNotGetThroughIsSentAgainBeforeRearming) {
  const auto stage = homed();
  bus_->fails = DeviceErrc::Timeout;
  stage->stop();
  expect_error(DeviceErrc::Timeout, "", [&] { stage->rearm(); });
  bus_->fails.reset();
  stage->rearm();
  ASSERT_FALSE(bus_->writes.empty());
  EXPECT_EQ(bus_->writes[0].request, modbus_bus::write_register(kCommand, 4));
}

TEST_F(ModbusStageTest, StopThatComesWhileTheOneBeforeIsRearmedStaysLatchedAndSet) {
  const auto stage = homed();
  stage->stop();
  bool stopped = false;
  bus_->on_read = [&](const Request&) {  // as another thread would
    if (!std::exchange(stopped, true)) stage->stop();
  };
  expect_error(DeviceErrc::Stopped, "", [&] { stage->rearm(); });
  EXPECT_EQ(bus_->registers[kCommand], 4);  // nothing has released it
  expect_error(DeviceErrc::Stopped, "", [&] { stage->begin_move_to(0.0_deg); });
  stage->rearm();
  EXPECT_EQ(bus_->registers[kCommand], 0);
}

TEST_F(ModbusStageTest, LostLinkUnhomesAndTheDriveIsIdentifiedAgain) {
  const auto stage = homed();
  bus_->fails = DeviceErrc::Disconnected;
  expect_error(DeviceErrc::Disconnected, "", [&] { stage->wait_until_settled(kPatience); });
  bus_->fails.reset();
  expect_error(DeviceErrc::NotHomed, "", [&] { stage->begin_move_to(0.0_deg); });
  bus_->registers[kResolution] = 1600;  // another drive behind the same unit
  expect_error(DeviceErrc::Protocol, "resolution: found 1600", [&] { stage->home(kPatience); });
}

TEST_F(ModbusStageTest, DriveThatWasSwitchedOffAndOnStartsNoMove) {
  const auto stage = homed();
  status(kEnabled | kDone);  // unasked: nobody has noticed
  position(0);
  expect_error(DeviceErrc::NotHomed, "lost its reference", [&] { stage->begin_move_to(20.0_deg); });
  status(kEnabled | kDone | kHomed | kFault);
  expect_error(DeviceErrc::NotHomed, "home", [&] { stage->begin_move_to(20.0_deg); });
  EXPECT_TRUE(bus_->writes.empty());
}

TEST_F(ModbusStageTest, MoveWithoutAnAnswerIsSentAgainIfTheDriveKnowsWhereItIs) {
  const auto stage = homed();
  int lost = 0;
  bus_->fails = DeviceErrc::Timeout;
  bus_->fails_only = [&](const Request& request) {
    return request.address == kMove && lost++ == 0;
  };
  stage->begin_move_to(20.0_deg);
  EXPECT_EQ(bus_->writes.size(), 1U);
  EXPECT_NEAR(stage->wait_until_settled(kPatience).degrees(), 20.0, 1e-9);
  bus_->fails_only = [&](const Request& request) {
    if (request.address == kMove) status(kEnabled);  // its power went meanwhile
    return request.address == kMove;
  };
  expect_error(DeviceErrc::NotHomed, "lost its reference", [&] { stage->begin_move_to(0.0_deg); });
  EXPECT_EQ(bus_->writes.size(), 1U);
}

TEST_F(ModbusStageTest, BitsOfTheMoveBeforeAreNoArrivalOfAShortOne) {
  DriveProfile profile = some_drive();
  profile.start_time = 500ms;
  const auto stage = homed(profile);
  bus_->on_write = nullptr;         // it has not started yet
  stage->begin_move_to(10.01_deg);  // one step from where it stands
  const auto begun = std::chrono::steady_clock::now();
  stage->wait_until_settled(kPatience);  // 100 s of the session, 1 s of the host's
  EXPECT_GE(std::chrono::steady_clock::now() - begun, 500ms);
  stage->begin_move_to(10.0_deg);
  status(kEnabled | kHomed | kMoving);
  int reads = 0;
  bus_->on_read = [&](const Request& request) {  // seen moving once, then there
    if (request.address == kStatus && reads++ == 1) status(kEnabled | kHomed | kDone);
  };
  const auto second = std::chrono::steady_clock::now();
  stage->wait_until_settled(kPatience);
  EXPECT_LT(std::chrono::steady_clock::now() - second, 500ms);
}

TEST_F(ModbusStageTest, StopThatAnotherProcessLeftSetIsReleasedOnTakeOver) {
  status(kEnabled | kDone | kHomed);
  bus_->registers[kCommand] = 4;
  const auto taken_over = make();
  taken_over->rearm();
  EXPECT_EQ(bus_->registers[kCommand], 0);
  status(kEnabled | kDone | kHomed);
  bus_->registers[kCommand] = 4;
  const auto moved_at_once = make();
  moved_at_once->begin_move_to(20.0_deg);
  EXPECT_EQ(bus_->registers[kCommand], 0);
}

TEST_F(ModbusStageTest, StopIsOneAttemptAndTheSecondRoundTakesSeveral) {
  const auto stage = homed();
  bus_->fails = DeviceErrc::Timeout;
  stage->stop();
  expect_error(DeviceErrc::Timeout, "", [&] { stage->require_standing(); });
  bus_->fails.reset();
  stage->require_standing();
  stage->require_standing();  // it got through: not sent again
  ASSERT_EQ(bus_->writes.size(), 1U);
  EXPECT_EQ(bus_->writes[0].attempts, modbus_bus::Attempts::several);
  expect_error(DeviceErrc::Stopped, "", [&] { stage->begin_move_to(0.0_deg); });
  stage->stop();
  EXPECT_EQ(bus_->writes.back().attempts, modbus_bus::Attempts::one);
}

TEST_F(ModbusStageTest, RequireStandingStopsAndSaysIfTheAxisMovesOn) {
  const auto stage = homed();
  stage->begin_move_to(20.0_deg);
  status(kEnabled | kHomed | kMoving);
  expect_error(DeviceErrc::Fault, "moves on after a stop", [&] { stage->require_standing(); });
  EXPECT_EQ(bus_->writes.back().request, modbus_bus::write_register(kCommand, 4));
  EXPECT_TRUE(bus_->writes.back().urgent);
}

TEST_F(ModbusStageTest, SilentDriveIsAskedOrIsNotHomed) {
  const auto silence = [this](ModbusStage& stage) {
    bus_->fails = DeviceErrc::Timeout;
    expect_error(DeviceErrc::Timeout, "", [&] { stage.wait_until_settled(kPatience); });
    bus_->fails.reset();
  };
  const auto tells = homed();
  silence(*tells);
  EXPECT_NO_THROW(tells->begin_move_to(0.0_deg));
  tells->wait_until_settled(kPatience);
  silence(*tells);
  status(kEnabled | kDone);  // it was switched off
  bus_->writes.clear();
  expect_error(DeviceErrc::NotHomed, "lost its reference", [&] { tells->begin_move_to(5.0_deg); });
  DriveProfile profile = some_drive();
  profile.homed = {};
  const auto does_not_tell = homed(profile);
  silence(*does_not_tell);
  expect_error(DeviceErrc::NotHomed, "", [&] { does_not_tell->begin_move_to(0.0_deg); });
  EXPECT_TRUE(bus_->writes.empty());
  profile.absolute_encoder = true;
  const auto does_not_forget = homed(profile);
  silence(*does_not_forget);
  EXPECT_NO_THROW(does_not_forget->begin_move_to(0.0_deg));
}

TEST_F(ModbusStageTest, UnconfirmedRegisterThatMovesIsRefusedUntilConfirmed) {
  DriveProfile profile = some_drive();
  profile.registers[6].confirmed = false;  // command
  EXPECT_THAT([&] { make(profile); },
              testing::ThrowsMessage<std::invalid_argument>(testing::AllOf(
                  HasSubstr("\"command\" (0x0030)"), HasSubstr("confirmed = [\"command\"]"))));
  EXPECT_TRUE(bus_->writes.empty());
  EXPECT_NO_THROW(make(profile, {100.0}, {"command"}));
  EXPECT_THAT([&] { make(profile, {100.0}, {"comand"}); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("\"comand\"")));
}

TEST_F(ModbusStageTest, UnconfirmedAlarmRegisterIsNotRead) {
  DriveProfile profile = some_drive();
  profile.registers[2].confirmed = false;  // alarm
  const auto stage = homed(profile);
  status(kEnabled | kHomed | kFault);
  bus_->on_read = [](const Request& request) { EXPECT_NE(request.address, kAlarm); };
  expect_error(DeviceErrc::Fault, "see its display", [&] { stage->wait_until_settled(kPatience); });
}

TEST_F(ModbusStageTest, ConstructorRefusesWhatCannotWork) {
  EXPECT_THROW(make(some_drive(), {0.0}), std::invalid_argument);
  EXPECT_THROW(make(some_drive(), {std::numeric_limits<double>::quiet_NaN()}),
               std::invalid_argument);
  // 16 bits of speed: 65536 steps/s are too many.
  EXPECT_THAT([&] { make(some_drive(), {65536.0 / 20.0}); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("axis tilt: speed")));
  EXPECT_THAT([&] { make(some_drive(), {1e9}); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("axis tilt")));
  bus_->registers[kResolution] = 400;
  expect_error(DeviceErrc::Protocol, "expects 10000", [&] { make(); });
  bus_->fails = DeviceErrc::Timeout;
  expect_error(DeviceErrc::Timeout, "", [&] { make(); });
}

}  // namespace
}  // namespace gonio::modbus_stage
