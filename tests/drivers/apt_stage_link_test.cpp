// What a stage makes of its line: lost, late, garbled and endless.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>

#include "recording_unit.h"

namespace gonio::apt_stage {
namespace {

using contracts::ThrowsDeviceError;
using devices::DeviceErrc;
using testing::Contains;
using Wall = std::chrono::steady_clock;
using namespace gonio::literals;
using namespace std::chrono_literals;

using AptStageLinkTest = AptStageTest;

TEST_F(AptStageLinkTest, UnpluggedItIsNotHomedAndHomeReconnectsAndSetsUp) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->unplug();
  EXPECT_THAT([&] { stage_->wait_until_settled(1min); },
              ThrowsDeviceError(DeviceErrc::Disconnected));
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::NotHomed));
  stage_->stop();  // must not throw
  stage_->rearm();
  unit_->velocity = Bytes(14, 0);
  unit_->sent.clear();
  homed();
  EXPECT_EQ(unit_->reconnections, 1);
  EXPECT_THAT(unit_->sent, Contains(MessageId::HW_REQ_INFO));
  EXPECT_EQ(unit_->velocity[6], 0x58);
}

TEST_F(AptStageLinkTest, AcknowledgesStatusLongBeforeTheUnitFallsSilent) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(5.0, status::kMovingForward);
  EXPECT_THAT([&] { stage_->wait_until_settled(5s); }, ThrowsDeviceError(DeviceErrc::Timeout));
  const auto asked = unit_->count(MessageId::MOT_REQ_DCSTATUSUPDATE);
  const auto acknowledged = unit_->count(MessageId::MOT_ACK_DCSTATUSUPDATE);
  EXPECT_GT(asked, 100);
  EXPECT_GE(acknowledged, asked / 50);
}

TEST_F(AptStageLinkTest, GarbageBeforeAnAnswerCostsNothing) {
  homed();
  unit_->on_message = [&](MessageId id) {
    if (id == MessageId::MOT_REQ_DCSTATUSUPDATE) unit_->say({0xFF, 0x91, 0x04, 0x33});
  };
  EXPECT_NO_THROW(stage_->begin_move_to(20.0_deg));
}

TEST_F(AptStageLinkTest, UnansweredQuestionIsAskedThreeTimes) {
  homed();
  unit_->answers_status = false;
  unit_->sent.clear();
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::Timeout));
  EXPECT_EQ(unit_->count(MessageId::MOT_REQ_DCSTATUSUPDATE), 3);
}

TEST_F(AptStageLinkTest, LateAnswerIsNotTakenForThatOfTheRepetition) {
  homed();
  unit_->answers_status = false;
  int asked = 0;
  unit_->on_message = [&](MessageId id) {
    if (id != MessageId::MOT_REQ_DCSTATUSUPDATE || ++asked == 1) return;
    for (const double deg : {5.0, 10.0}) {  // the answer to the first question, then to this one
      unit_->stand_at(deg);
      unit_->answer(MessageId::MOT_GET_DCSTATUSUPDATE, unit_->status_data());
    }
  };
  EXPECT_NEAR(stage_->wait_until_settled(1min).degrees(), 20.0, 1e-5);
}

TEST_F(AptStageLinkTest, AnswerAboutAnotherChannelIsNone) {
  homed();
  unit_->on_message = [&](MessageId id) {
    if (id != MessageId::MOT_REQ_DCSTATUSUPDATE) return;
    unit_->stand_at(5.0);
    Bytes other = unit_->status_data();
    other[0] = 2;
    unit_->answer(MessageId::MOT_GET_DCSTATUSUPDATE, other);
    unit_->stand_at(10.0);
  };
  EXPECT_NEAR(stage_->wait_until_settled(1min).degrees(), 20.0, 1e-5);
}

TEST_F(AptStageLinkTest, LineThatNeverFallsSilentEndsAsAnErrorInTime) {
  homed();
  const auto begun = Wall::now();
  unit_->chatter_until = begun + 8s;
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::Protocol));
  EXPECT_THAT([&] { stage_->home(1min); }, ThrowsDeviceError(DeviceErrc::Protocol));
  EXPECT_LT(Wall::now() - begun, 5s);  // two questions of three attempts
}

TEST_F(AptStageLinkTest, HomingHoldsNoStopUpWhileItReads) {
  homed();
  std::future<void> stopping;
  unit_->on_read = [&](usb_bus::ByteStream::Deadline deadline) {
    const bool unasked = deadline == 0ms && unit_->sent.back() == MessageId::MOT_REQ_DCSTATUSUPDATE;
    if (!unasked || stopping.valid()) return;
    stopping = std::async(std::launch::async, [&] { stage_->stop(); });
    EXPECT_EQ(stopping.wait_for(5s), std::future_status::ready);
  };
  EXPECT_THAT([&] { stage_->home(1min); }, ThrowsDeviceError(DeviceErrc::Stopped));
  ASSERT_TRUE(stopping.valid());
  EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_HOME), 1);  // the first
}

TEST_F(AptStageLinkTest, AnotherUnitInItsPlaceIsRefusedAgainAndAgain) {
  homed();
  unit_->unplug();
  unit_->serial = 43;
  for (int attempt = 1; attempt <= 2; ++attempt) {
    EXPECT_THAT([&] { stage_->home(1min); },
                says(DeviceErrc::Protocol, "serial 42 came back as 43"));
    EXPECT_EQ(unit_->reconnections, attempt);
  }
  EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_HOME), 1);
  unit_->serial = 42;
  EXPECT_NO_THROW(homed());
}

}  // namespace
}  // namespace gonio::apt_stage
