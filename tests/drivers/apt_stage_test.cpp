// The stage as it is set up, moves and homes, over a recording unit; over a real bus it runs in
// tests/contracts.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "recording_unit.h"

namespace gonio::apt_stage {
namespace {

using contracts::ThrowsDeviceError;
using devices::DeviceErrc;
using testing::ElementsAre;
using testing::HasSubstr;
using namespace gonio::literals;
using namespace std::chrono_literals;

TEST_F(AptStageTest, IntroducesItselfThenIdentifiesThenSetsUp) {
  using enum MessageId;
  EXPECT_THAT(unit_->sent, ElementsAre(HW_NO_FLASH_PROGRAMMING, HW_STOP_UPDATEMSGS, HW_REQ_INFO,
                                       MOT_ACK_DCSTATUSUPDATE, MOD_SET_CHANENABLESTATE,
                                       MOT_SET_VELPARAMS, MOT_SET_HOMEPARAMS, MOT_REQ_VELPARAMS,
                                       MOT_REQ_HOMEPARAMS, MOT_REQ_DCSTATUSUPDATE));
  EXPECT_EQ(stage_->identity().serial, 42u);
}

TEST_F(AptStageTest, TakesAHomedUnitOverWhereItStands) {
  unit_->stand_at(5.0);
  open();
  EXPECT_NEAR(stage_->wait_until_settled(1min).degrees(), 15.0, 1e-5);
  EXPECT_NO_THROW(stage_->begin_move_to(20.0_deg));
}

TEST_F(AptStageTest, ReadingAStandingAxisIsOneQuestion) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(10.0);
  stage_->wait_until_settled(1min);
  unit_->sent.clear();
  const auto before = clock_.now();
  stage_->wait_until_settled(1min);
  EXPECT_THAT(unit_->sent, ElementsAre(MessageId::MOT_REQ_DCSTATUSUPDATE));
  EXPECT_EQ(clock_.now(), before);
}

TEST_F(AptStageTest, SetsSpeedsInTheUnitsOfItsModel) {
  // 10 deg/s = 73,291,090 and 20 deg/s^2 = 30,040.
  EXPECT_THAT(unit_->velocity,
              ElementsAre(1, 0, 0, 0, 0, 0, 0x58, 0x75, 0, 0, 0x52, 0x55, 0x5E, 0x04));
}

TEST_F(AptStageTest, RefusesAnotherModel) {
  unit_->model = "PRM1-Z8";
  EXPECT_THAT([&] { open(); }, says(DeviceErrc::Protocol, "PRM1-Z8"));
}

TEST_F(AptStageTest, RefusesAUnitThatDoesNotTakeItsSettings) {
  unit_->takes_settings = false;
  unit_->velocity.at(6) = 0;
  EXPECT_THAT([&] { open(); }, says(DeviceErrc::Protocol, "did not take"));
}

TEST_F(AptStageTest, RefusesSpeedsBeyondTheModel) {
  const devices::AxisSetup fast{"azimuth", {-1.0_deg, 1.0_deg}, 0.0_deg, 12.0, 20.0, 0ms};
  EXPECT_THAT([&] { AptStage(unit_, fast, k10cr1(), false, clock_); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("max_speed_deg_per_s")));
}

TEST_F(AptStageTest, CountsFromItsHomeMark) {
  homed();
  stage_->begin_move_to(55.0_deg);  // 45 deg from home: 45 * 409600 / 3 = 6,144,000
  EXPECT_EQ(unit_->last, move_absolute(6144000));
  unit_->stand_at(45.0);
  EXPECT_NEAR(stage_->wait_until_settled(1min).degrees(), 55.0, 1e-5);
}

TEST_F(AptStageTest, CountsDownWhenReversed) {
  open(true);
  homed();
  stage_->begin_move_to(55.0_deg);
  EXPECT_EQ(unit_->last, move_absolute(-6144000));
  unit_->stand_at(-45.0);
  EXPECT_NEAR(stage_->wait_until_settled(1min).degrees(), 55.0, 1e-5);
}

TEST_F(AptStageTest, SettlesOnlyWhenCompletedAndStandingAndThere) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(10.0, status::kSettled | status::kMovingForward);
  EXPECT_THAT([&] { stage_->wait_until_settled(1s); }, says(DeviceErrc::Timeout, "still moving"));
  unit_->stand_at(10.0, 0);
  EXPECT_THAT([&] { stage_->wait_until_settled(1s); },
              says(DeviceErrc::Timeout, "not reported as completed"));
  unit_->stand_at(9.9);
  EXPECT_THAT([&] { stage_->wait_until_settled(1s); }, says(DeviceErrc::Timeout, "0.1000 deg"));
  unit_->stand_at(10.0);
  EXPECT_NO_THROW(stage_->wait_until_settled(1s));
}

TEST_F(AptStageTest, CompletionMayBeAMessageInsteadOfABit) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(10.0, 0);
  unit_->answer(MessageId::MOT_MOVE_COMPLETED, unit_->status_data());
  EXPECT_NO_THROW(stage_->wait_until_settled(1min));
}

TEST_F(AptStageTest, CompletionOfAnEarlierMoveIsNotThatOfThisOne) {
  homed();
  unit_->answer(MessageId::MOT_MOVE_COMPLETED, unit_->status_data());
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(10.0, 0);
  EXPECT_THAT([&] { stage_->wait_until_settled(1s); }, ThrowsDeviceError(DeviceErrc::Timeout));
}

TEST_F(AptStageTest, WaitsTheSettlingTimeOnceOnTheSessionsClock) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(10.0);
  const auto arrived = clock_.now();
  stage_->wait_until_settled(1min);
  const auto settled = clock_.now();
  EXPECT_GE(settled - arrived, 500ms);
  EXPECT_LT(settled - arrived, 550ms);
  stage_->wait_until_settled(1min);
  EXPECT_EQ(clock_.now(), settled);
}

TEST_F(AptStageTest, HomedBitOfAnEarlierHomingIsNotEnough) {
  unit_->stand_at(0.0);
  EXPECT_THAT([&] { stage_->home(5s); }, says(DeviceErrc::Timeout, "not home"));
  EXPECT_EQ(unit_->sent.back(), MessageId::MOT_MOVE_STOP);
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::NotHomed));
}

TEST_F(AptStageTest, HomingSeenInTheStatusIsAsGoodAsItsMessage) {
  unit_->bits = kAtRest | status::kHoming;
  clock_.on_wait = [&](devices::Clock::Duration now) {
    if (now > 2s) unit_->stand_at(0.0);
  };
  EXPECT_NO_THROW(stage_->home(1min));
}

TEST_F(AptStageTest, TakenOverOnItsWayItIsWaitedForAndSettles) {
  unit_->stand_at(5.0, status::kMovingForward);
  open();
  EXPECT_THAT([&] { stage_->wait_until_settled(1s); }, says(DeviceErrc::Timeout, "still moving"));
  devices::Clock::Duration stood{0};
  clock_.on_wait = [&](devices::Clock::Duration now) {
    if (now < 3s || stood > 0s) return;
    unit_->stand_at(8.0);
    stood = now;
  };
  EXPECT_NEAR(stage_->wait_until_settled(1min).degrees(), 18.0, 1e-5);
  EXPECT_GE(clock_.now() - stood, 500ms);
}

TEST_F(AptStageTest, TurnedAtItsPanelItIsReadWhereItStandsThen) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(10.0);
  stage_->wait_until_settled(1min);
  unit_->stand_at(11.0, status::kJoggingForward);
  clock_.on_wait = [&](devices::Clock::Duration) { unit_->stand_at(12.0); };
  EXPECT_NEAR(stage_->wait_until_settled(1min).degrees(), 22.0, 1e-5);
}

TEST_F(AptStageTest, SearchesItsMarkInTheJointsDirection) {
  const auto direction_and_switch = [&](bool reversed, HomeDirection direction) {
    open(reversed, direction);
    return std::pair<int, int>(unit_->home.at(2), unit_->home.at(4));
  };
  EXPECT_EQ(direction_and_switch(false, HomeDirection::falling), std::pair(2, 1));
  EXPECT_EQ(direction_and_switch(false, HomeDirection::rising), std::pair(1, 4));
  EXPECT_EQ(direction_and_switch(true, HomeDirection::falling), std::pair(1, 4));
  EXPECT_EQ(direction_and_switch(true, HomeDirection::rising), std::pair(2, 1));
}

TEST_F(AptStageTest, GoesToTheSideOfItsMarkFromWhichTheSearchLeadsThere) {
  homed();
  for (const bool behind : {true, false}) {
    unit_->stand_at(behind ? -50.0 : 50.0);
    unit_->sent.clear();
    Bytes move;
    unit_->on_message = [&](MessageId id) {
      if (id == MessageId::MOT_MOVE_ABSOLUTE) {
        move = unit_->last;
        unit_->stand_at(4.0);
      }
      if (id != MessageId::MOT_MOVE_HOME) return;
      unit_->stand_at(0.0);
      unit_->say({0x44, 0x04, 0x01, 0x00, 0x01, 0x50});
    };
    stage_->home(1min);
    // 4 deg before it: 4 * 409600 / 3 = 546,133.
    EXPECT_EQ(move, behind ? move_absolute(546133) : Bytes());
    EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_HOME), 1);
  }
}

TEST_F(AptStageTest, WayToTheSearchThatFailsLeavesItStoppedAndNotHomed) {
  homed();
  unit_->stand_at(-50.0);
  EXPECT_THAT([&] { stage_->home(1min); }, ThrowsDeviceError(DeviceErrc::Timeout));
  EXPECT_EQ(unit_->sent.back(), MessageId::MOT_MOVE_STOP);
  EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_HOME), 1);
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::NotHomed));
}

}  // namespace
}  // namespace gonio::apt_stage
