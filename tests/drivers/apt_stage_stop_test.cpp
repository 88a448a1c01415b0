// How a stage is stopped, armed again, and what its own alarms do.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "recording_unit.h"

namespace gonio::apt_stage {
namespace {

using contracts::ThrowsDeviceError;
using devices::DeviceErrc;
using namespace gonio::literals;
using namespace std::chrono_literals;

using AptStageStopTest = AptStageTest;

TEST_F(AptStageStopTest, StopSendsTheImmediateStopAndNothingMovesUntilRearmed) {
  homed();
  stage_->begin_move_to(20.0_deg);
  stage_->stop();
  EXPECT_EQ(unit_->last, move_stop(StopMode::immediate));
  EXPECT_THAT([&] { stage_->begin_move_to(30.0_deg); }, ThrowsDeviceError(DeviceErrc::Stopped));
  EXPECT_THAT([&] { stage_->home(1min); }, ThrowsDeviceError(DeviceErrc::Stopped));
  EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_ABSOLUTE), 1);
  unit_->stand_at(3.0);
  stage_->rearm();
  EXPECT_NEAR(stage_->wait_until_settled(1min).degrees(), 13.0, 1e-5);
}

TEST_F(AptStageStopTest, StopThatIsIgnoredIsAFaultAndKeepsTheLatch) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(5.0, status::kMovingForward);
  stage_->stop();
  EXPECT_THAT([&] { stage_->rearm(); }, says(DeviceErrc::Fault, "ignored stop"));
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::Stopped));
}

TEST_F(AptStageStopTest, StopThatWasLostIsRepeatedWhenRearmed) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(5.0, status::kMovingForward);
  stage_->stop();
  unit_->on_message = [&](MessageId id) {
    if (id == MessageId::MOT_MOVE_STOP) unit_->stand_at(6.0);
  };
  EXPECT_NO_THROW(stage_->rearm());
}

TEST_F(AptStageStopTest, StopThatComesWhileTheOneBeforeIsRearmedStaysLatched) {
  homed();
  stage_->stop();
  bool stopped = false;
  unit_->on_message = [&](MessageId id) {  // as another thread would
    if (id == MessageId::MOT_REQ_DCSTATUSUPDATE && !std::exchange(stopped, true)) stage_->stop();
  };
  EXPECT_THAT([&] { stage_->rearm(); }, ThrowsDeviceError(DeviceErrc::Stopped));
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::Stopped));
  EXPECT_NO_THROW(stage_->rearm());
}

TEST_F(AptStageStopTest, LostHomedBitMeansNotHomed) {
  homed();
  unit_->bits = kAtRest;
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, says(DeviceErrc::NotHomed, "switched off"));
  EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_ABSOLUTE), 0);
  unit_->stand_at(0.0);  // what it says later does not bring it back
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::NotHomed));
}

TEST_F(AptStageStopTest, EveryAlarmBitIsAFault) {
  homed();
  for (const auto& [bit, words] : {std::pair(status::kOverload, "overload"),
                                   std::pair(status::kPositionError, "position error"),
                                   std::pair(status::kOverheat, "overheated")}) {
    unit_->stand_at(0.0, bit);
    EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, says(DeviceErrc::Fault, words));
    EXPECT_THAT([&] { stage_->home(1min); }, says(DeviceErrc::Fault, words));
    stage_->stop();
    EXPECT_THAT([&] { stage_->rearm(); }, says(DeviceErrc::Fault, words));
    unit_->stand_at(10.0);  // from where homing needs no move first
    stage_->rearm();
    homed();
  }
  EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_ABSOLUTE), 0);
}

// Half of one message with the next behind it, as a torn transfer leaves it, has no checksum that
// would tell.
TEST_F(AptStageStopTest, AlarmThatIsNotSaidTwiceIsNoFault) {
  homed();
  int asked = 0;
  unit_->on_message = [&](MessageId id) {
    if (id != MessageId::MOT_REQ_DCSTATUSUPDATE) return;
    unit_->stand_at(0.0, ++asked == 1 ? status::kOverload : 0);
  };
  EXPECT_NO_THROW(stage_->begin_move_to(20.0_deg));
  EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_ABSOLUTE), 1);
}

TEST_F(AptStageStopTest, LimitBitIsTheHomeSwitchNearHomeAndAFaultElsewhere) {
  homed();
  unit_->stand_at(1.0, status::kReverseLimit);
  EXPECT_NO_THROW(stage_->begin_move_to(20.0_deg));
  unit_->stand_at(5.0, status::kForwardLimit);
  EXPECT_THAT([&] { stage_->wait_until_settled(1min); },
              says(DeviceErrc::Fault, "forward limit switch"));
}

TEST_F(AptStageStopTest, RequiresAnAxisToStandWhateverItsLatch) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(5.0, status::kMovingForward);
  stage_->stop();
  EXPECT_THAT([&] { stage_->require_standing(); }, says(DeviceErrc::Fault, "ignored stop"));
  unit_->on_message = [&](MessageId id) {
    if (id == MessageId::MOT_MOVE_STOP) unit_->stand_at(6.0, status::kOverload);
  };
  EXPECT_NO_THROW(stage_->require_standing());  // by the stop it repeats, and alarm or not
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::Stopped));
  unit_->unplug();
  EXPECT_THAT([&] { stage_->require_standing(); }, ThrowsDeviceError(DeviceErrc::Disconnected));
}

}  // namespace
}  // namespace gonio::apt_stage
