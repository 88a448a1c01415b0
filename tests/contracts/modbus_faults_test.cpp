// Every fault of Modbus and of drives, over the wire: the code it ends with, and when. None ends as
// a good angle.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <string>
#include <thread>

#include "modbus_rig.h"
#include "throws_device_error.h"

namespace gonio::contracts {
namespace {

using devices::DeviceErrc;
using emulator_faults::Fault;
using namespace gonio::literals;

using Host = std::chrono::steady_clock;

constexpr double kResolutionDeg = 0.007;  // encoder step, positioning, half a step of the drive
constexpr modbus_bus::BusOptions kBus{.response_timeout = 100ms, .retries = 2};
const std::string kDeadForOneQuestion = "dead_link:count=3";  // as often as it is asked
// Three attempts of six response times, as open_bus.h says; and what a busy host adds.
constexpr std::chrono::milliseconds kBusDeadline{3 * 600 + 1000};

std::string name_of_family(const testing::TestParamInfo<Family>& info) {
  return info.param == Family::leadshine ? "leadshine" : "az";
}

/// A homed lamp arm (unit 1) whose faults begin now.
class ModbusFaults : public testing::TestWithParam<Family> {
 protected:
  /// `fault` as on the command line, for example "crc_error:count=1".
  void begin(const std::string& fault) {
    home();
    add(fault);
  }

  void home() {
    rig_.emplace(GetParam(), std::vector<std::string>{}, kBus);
    stage_ = rig_->stage(0);
    stage_->home(kPatience);
  }

  void add(const std::string& fault) {
    std::string rule = fault;
    rig_->faults().add(rules({rule.insert(std::min(rule.find(':'), rule.size()), "@lamp_arm")})[0]);
  }

  Angle at_share(double share) const {
    return stage_->limits().min + share * (stage_->limits().max - stage_->limits().min);
  }

  Angle joint_angle() { return rig_->world().joint(0).encoder(rig_->world().clock().now()); }

  Angle go_to(Angle target) {
    stage_->begin_move_to(target);
    return stage_->wait_until_settled(kPatience);
  }

  /// Expects a failure of this code and within the deadline; returns its text.
  template <class Action>
  std::string expect_failure(DeviceErrc code, std::chrono::milliseconds deadline, Action action) {
    const auto begun = Host::now();
    std::string text;
    try {
      action();
      ADD_FAILURE() << "ended well";
    } catch (const devices::DeviceError& error) {
      EXPECT_EQ(error.code(), code) << error.what();
      EXPECT_EQ(error.device(), "lamp_arm");
      text = error.what();
    }
    EXPECT_LT(Host::now() - begun, deadline);
    return text;
  }

  /// A fault that strikes once is survived, and the angle is right.
  void expect_survived(const std::string& fault, Fault kind) {
    begin(fault);
    for (const double share : {0.3, 0.6}) {
      EXPECT_NEAR(go_to(at_share(share)).degrees(), at_share(share).degrees(), kResolutionDeg);
    }
    EXPECT_GE(rig_->faults().struck(kind), 1U);
  }

  void expect_no_absolute_move_after_a_power_cycle(bool noticed) {
    home();
    go_to(at_share(0.9));
    add("power_cycle:count=1");
    if (noticed) {
      add(kDeadForOneQuestion);
      expect_failure(DeviceErrc::Timeout, kBusDeadline,
                     [&] { stage_->wait_until_settled(kPatience); });
    }
    if (GetParam() == Family::az) {
      EXPECT_NEAR(go_to(at_share(0.5)).degrees(), at_share(0.5).degrees(), kResolutionDeg);
      EXPECT_NEAR(joint_angle().degrees(), at_share(0.5).degrees(), kResolutionDeg);
      return;
    }
    const Angle before = joint_angle();
    for (int i = 0; i < 2; ++i) {
      EXPECT_THAT([&] { stage_->begin_move_to(at_share(0.5)); },
                  ThrowsDeviceError(DeviceErrc::NotHomed));
    }
    EXPECT_EQ(rig_->faults().struck(Fault::power_cycle), 1U);
    EXPECT_EQ(joint_angle(), before);
    EXPECT_LE(rig_->world().joint(0).settled_at(), rig_->world().clock().now());
    stage_->home(kPatience);
    EXPECT_NEAR(go_to(at_share(0.5)).degrees(), at_share(0.5).degrees(), kResolutionDeg);
  }

  std::optional<ModbusRig> rig_;
  std::unique_ptr<modbus_stage::ModbusStage> stage_;
};

TEST_P(ModbusFaults, DeadLinkIsATimeoutAndOverWhenTheLinkIsBack) {
  begin(kDeadForOneQuestion);
  expect_failure(DeviceErrc::Timeout, kBusDeadline, [&] { go_to(at_share(0.5)); });
  stage_->home(kPatience);
  EXPECT_NEAR(go_to(at_share(0.5)).degrees(), at_share(0.5).degrees(), kResolutionDeg);
}

TEST_P(ModbusFaults, ExceptionIsAFaultInWords) {
  begin("exception");
  const std::string text =
      expect_failure(DeviceErrc::Fault, kBusDeadline, [&] { go_to(at_share(0.5)); });
  EXPECT_THAT(text, testing::HasSubstr("device failure (04)"));
}

TEST_P(ModbusFaults, WrongChecksumsAreAProtocolError) {
  begin("crc_error");
  expect_failure(DeviceErrc::Protocol, kBusDeadline, [&] { go_to(at_share(0.5)); });
}

TEST_P(ModbusFaults, OneWrongChecksumIsAskedAgain) {
  expect_survived("crc_error:count=1", Fault::crc_error);
}

TEST_P(ModbusFaults, LateRepliesAreATimeout) {
  begin("late_reply");
  expect_failure(DeviceErrc::Timeout, kBusDeadline, [&] { go_to(at_share(0.5)); });
}

TEST_P(ModbusFaults, OneLateReplyIsNotTakenForTheAnswerToTheNextRequest) {
  expect_survived("late_reply:count=1", Fault::late_reply);
}

TEST_P(ModbusFaults, SomeLateRepliesLeaveEveryAngleRight) {
  expect_survived("late_reply:probability=0.1,count=4", Fault::late_reply);
}

TEST_P(ModbusFaults, TornRepliesAreATimeout) {
  begin("torn_reply");
  expect_failure(DeviceErrc::Timeout, kBusDeadline, [&] { go_to(at_share(0.5)); });
}

TEST_P(ModbusFaults, OneTornReplyIsAskedAgain) {
  expect_survived("torn_reply:count=1", Fault::torn_reply);
}

TEST_P(ModbusFaults, ForeignRepliesAreAProtocolError) {
  begin("foreign_reply");
  expect_failure(DeviceErrc::Protocol, kBusDeadline, [&] { go_to(at_share(0.5)); });
}

TEST_P(ModbusFaults, ForeignRepliesOnceOfAnotherUnitOnceToAnotherRequestAreAskedAgain) {
  expect_survived("foreign_reply:count=2", Fault::foreign_reply);
}

TEST_P(ModbusFaults, AlarmIsAFaultWithTheDrivesOwnWordsUntilItIsReset) {
  begin("alarm:count=1");
  const std::string text = expect_failure(DeviceErrc::Fault, 5s, [&] { go_to(at_share(0.9)); });
  EXPECT_THAT(text, testing::HasSubstr(GetParam() == Family::leadshine ? "alarm 0x01: over-current"
                                                                       : "alarm 0x30: overload"));
  EXPECT_THAT([&] { stage_->begin_move_to(at_share(0.5)); },
              ThrowsDeviceError(DeviceErrc::NotHomed));
  expect_failure(DeviceErrc::Fault, 5s, [&] { stage_->home(kPatience); });
  expect_failure(DeviceErrc::Fault, 5s, [&] { stage_->rearm(); });
  stage_->reset_alarm();
  stage_->home(kPatience);
  EXPECT_NEAR(go_to(at_share(0.5)).degrees(), at_share(0.5).degrees(), kResolutionDeg);
}

TEST_P(ModbusFaults, LimitSwitchIsAFault) {
  begin("limit_switch:count=1");
  const std::string text = expect_failure(DeviceErrc::Fault, 5s, [&] { go_to(at_share(0.9)); });
  EXPECT_THAT(text, testing::HasSubstr("limit switch"));
}

TEST_P(ModbusFaults, NeverInPositionIsATimeoutWithBothPositions) {
  begin("never_in_position:count=1");
  const Angle target = at_share(0.9);
  const std::string text = expect_failure(DeviceErrc::Timeout, 5s, [&] { go_to(target); });
  EXPECT_THAT(text, testing::HasSubstr("stands at"));
  EXPECT_THAT(text, testing::HasSubstr("target"));
  EXPECT_NEAR(go_to(at_share(0.2)).degrees(), at_share(0.2).degrees(), kResolutionDeg);
}

TEST_P(ModbusFaults, IgnoredStopIsAFaultAndTheStageStaysStopped) {
  begin("stop_ignored");
  go_to(stage_->limits().min);
  stage_->begin_move_to(stage_->limits().max);
  stage_->stop();
  expect_failure(DeviceErrc::Fault, 5s, [&] { stage_->rearm(); });
  EXPECT_THAT([&] { stage_->begin_move_to(at_share(0.5)); },
              ThrowsDeviceError(DeviceErrc::Stopped));
}

TEST_P(ModbusFaults, StopOfAnotherProcessIsTakenBackByHoming) {
  begin("dead_link:count=0");
  stage_->stop();
  stage_ = rig_->stage(0);  // as a new process finds the drive after its watchdog
  stage_->home(kPatience);
  EXPECT_NEAR(go_to(at_share(0.5)).degrees(), at_share(0.5).degrees(), kResolutionDeg);
}

// What a drive counts from after a power cycle is where it stood: every target would be elsewhere.
TEST_P(ModbusFaults, CycledDriveStartsNoAbsoluteMoveUnlessItsEncoderIsAbsolute) {
  expect_no_absolute_move_after_a_power_cycle(false);
}

TEST_P(ModbusFaults, CycledDriveThatWasSilentMeanwhileStartsNoneEither) {
  expect_no_absolute_move_after_a_power_cycle(true);
}

TEST(ModbusStageTakeOver, DriveThatSaysItIsHomedNeedsNoHoming) {
  ModbusRig rig(Family::leadshine);
  rig.stage(0)->home(kPatience);
  const auto next = rig.stage(0);
  EXPECT_EQ(next->wait_until_settled(kPatience), rig.world().truth().rig.axes[0].home);
  next->begin_move_to(45_deg);
  EXPECT_NEAR(next->wait_until_settled(kPatience).degrees(), 45.0, kResolutionDeg);
}

TEST(ModbusStageTakeOver, DriveThatCannotSaySoIsHomedAgain) {
  ModbusRig rig(Family::az);
  rig.stage(0)->home(kPatience);
  EXPECT_THAT([&] { rig.stage(0)->begin_move_to(45_deg); },
              ThrowsDeviceError(DeviceErrc::NotHomed));
}

INSTANTIATE_TEST_SUITE_P(Modbus, ModbusFaults, testing::Values(Family::leadshine, Family::az),
                         name_of_family);

TEST(ModbusLampFaults, ShutterThatCouldNotBeClosedIsClosedBeforeAnythingElse) {
  ModbusRig rig(Family::leadshine, {}, kBus);
  const auto light = rig.light();
  light->light("G");
  // For the stop, which is one attempt, and the question after it.
  rig.faults().add(rules({"dead_link@lamp:count=4"})[0]);
  const auto begun = Host::now();
  light->close_shutter();
  EXPECT_LT(Host::now() - begun, kBusDeadline);
  EXPECT_THAT([&] { light->light("R"); }, ThrowsDeviceError(DeviceErrc::Timeout));
  EXPECT_GT(rig.world().lamp_monitor().read(), 0.5);  // as bright as it was
  EXPECT_NEAR(light->temperature_c(), 31.2, 0.05);
  EXPECT_LT(rig.world().lamp_monitor().read(), 0.01);
}

TEST(ModbusLampFaults, EachFaultEndsWithItsCode) {
  const std::pair<const char*, DeviceErrc> kEnds[] = {{"dead_link", DeviceErrc::Timeout},
                                                      {"late_reply", DeviceErrc::Timeout},
                                                      {"torn_reply", DeviceErrc::Timeout},
                                                      {"exception", DeviceErrc::Fault},
                                                      {"foreign_reply", DeviceErrc::Protocol}};
  for (const auto& [fault, code] : kEnds) {
    ModbusRig rig(Family::leadshine, {}, kBus);
    const auto light = rig.light();
    rig.faults().add(rules({std::string(fault) + "@lamp"})[0]);
    const auto begun = Host::now();
    EXPECT_THAT([&] { light->light("G"); }, ThrowsDeviceError(code)) << fault;
    EXPECT_LT(Host::now() - begun, kBusDeadline) << fault;
  }
}

TEST(ModbusLampFaults, OneFaultIsSurvived) {
  for (const char* const fault : {"dead_link", "late_reply", "torn_reply", "foreign_reply"}) {
    ModbusRig rig(Family::leadshine, {}, kBus);
    const auto light = rig.light();
    rig.faults().add(rules({std::string(fault) + "@lamp:count=1"})[0]);
    light->light("G");
    EXPECT_GT(rig.world().lamp_monitor().read(), 0.5) << fault;
  }
}

}  // namespace
}  // namespace gonio::contracts
