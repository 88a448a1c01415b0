// The stage's state machine over a recording unit; over a real bus it runs in tests/contracts.

#include "gonio/apt_stage/apt_stage.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "../contracts/throws_device_error.h"
#include "gonio/apt_stage/apt_decoder.h"

namespace gonio::apt_stage {
namespace {

using contracts::ThrowsDeviceError;
using devices::DeviceErrc;
using devices::DeviceError;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Property;
using testing::Throws;
using namespace gonio::literals;
using namespace std::chrono_literals;

constexpr double kStepsPerDeg = 49152000.0 / 360.0;
constexpr std::uint32_t kAtRest = status::kConnected | status::kEnabled | status::kPowerOk;

/// Time that passes when somebody waits.
class WaitedClock final : public devices::Clock {
 public:
  Duration now() const override { return now_; }
  void wait_until(Duration time) override {
    now_ = std::max(now_, time);
    if (on_wait) on_wait(now_);
  }
  std::function<void(Duration)> on_wait;

 private:
  Duration now_{0};
};

/// Answers as told and records what it was sent.
class RecordingUnit final : public usb_bus::ByteStream {
 public:
  const std::string& name() const override { return name_; }
  bool connected() const noexcept override { return connected_; }
  void reconnect(Deadline) override {
    ++reconnections;
    connected_ = true;
  }
  void purge() override { to_host_.clear(); }

  void write(std::span<const std::uint8_t> bytes) override {
    require_connected();
    ASSERT_GE(bytes.size(), 6u);
    const auto id = static_cast<MessageId>(bytes[0] | bytes[1] << 8U);
    sent.push_back(id);
    last = Bytes(bytes.begin(), bytes.end());
    const Bytes data(bytes.begin() + 6, bytes.end());
    if (on_message) on_message(id);
    switch (id) {
      case MessageId::HW_REQ_INFO: {
        Bytes info(84, 0);
        info[0] = 42;
        std::copy(model.begin(), model.end(), info.begin() + 4);
        answer(MessageId::HW_GET_INFO, info);
        break;
      }
      case MessageId::MOT_SET_VELPARAMS:
        if (takes_settings) velocity = data;
        break;
      case MessageId::MOT_SET_HOMEPARAMS:
        if (takes_settings) home = data;
        break;
      case MessageId::MOT_REQ_VELPARAMS:
        answer(MessageId::MOT_GET_VELPARAMS, velocity);
        break;
      case MessageId::MOT_REQ_HOMEPARAMS:
        answer(MessageId::MOT_GET_HOMEPARAMS, home);
        break;
      case MessageId::MOT_REQ_DCSTATUSUPDATE:
        if (answers_status) answer(MessageId::MOT_GET_DCSTATUSUPDATE, status_data());
        break;
      default:
        break;
    }
  }

  std::size_t read(std::span<std::uint8_t> room, Deadline) override {
    require_connected();
    const std::size_t count = std::min(room.size(), to_host_.size());
    std::copy_n(to_host_.begin(), count, room.begin());
    to_host_.erase(to_host_.begin(), to_host_.begin() + static_cast<std::ptrdiff_t>(count));
    return count;
  }

  Bytes status_data() const {
    Bytes data{1, 0};
    for (const auto word : {static_cast<std::uint32_t>(position), 0U, bits}) {
      for (std::size_t byte = 0; byte < 4; ++byte) {
        data.push_back(static_cast<std::uint8_t>(word >> (8 * byte)));
      }
    }
    return data;
  }
  void answer(MessageId id, const Bytes& data) {
    Message message;
    message.id = static_cast<std::uint16_t>(id);
    message.destination = kHost;
    message.source = kUnit;
    message.data = data;
    say(encode(message));
  }
  void say(const Bytes& bytes) { to_host_.insert(to_host_.end(), bytes.begin(), bytes.end()); }
  void unplug() { connected_ = false; }
  /// Stands at `deg` from home and says that it is done.
  void stand_at(double deg, std::uint32_t and_bits = status::kSettled) {
    position = static_cast<std::int32_t>(std::lround(deg * kStepsPerDeg));
    bits = kAtRest | status::kHomed | and_bits;
  }
  std::ptrdiff_t count(MessageId id) const { return std::count(sent.begin(), sent.end(), id); }

  std::string model = "K10CR1";
  bool takes_settings = true;
  bool answers_status = true;
  std::int32_t position = 0;
  std::uint32_t bits = kAtRest;
  Bytes velocity = Bytes(14, 0);
  Bytes home = Bytes(14, 0);
  std::vector<MessageId> sent;
  Bytes last;
  std::function<void(MessageId)> on_message;
  int reconnections = 0;

 private:
  void require_connected() const {
    if (!connected_) throw DeviceError(DeviceErrc::Disconnected, name_, "unplugged");
  }
  std::string name_ = "azimuth";
  bool connected_ = true;
  std::deque<std::uint8_t> to_host_;
};

class AptStageTest : public testing::Test {
 protected:
  AptStageTest() : unit_(std::make_shared<RecordingUnit>()) { open(); }

  void open(bool reversed = false) {
    stage_ = std::make_unique<AptStage>(
        unit_, devices::AxisSetup{"azimuth", {-170.0_deg, 170.0_deg}, 10.0_deg, 10.0, 20.0, 500ms},
        k10cr1(), reversed, clock_);
  }

  void homed() {
    unit_->on_message = [this](MessageId id) {
      if (id != MessageId::MOT_MOVE_HOME) return;
      unit_->stand_at(0.0);
      unit_->say({0x44, 0x04, 0x01, 0x00, 0x01, 0x50});
    };
    stage_->home(1min);
    unit_->on_message = nullptr;
  }

  static auto says(DeviceErrc code, const std::string& words) {
    return Throws<DeviceError>(AllOf(Property("code", &DeviceError::code, code),
                                     Property("what", &DeviceError::what, HasSubstr(words))));
  }

  WaitedClock clock_;
  std::shared_ptr<RecordingUnit> unit_;
  std::unique_ptr<AptStage> stage_;
};

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
  unit_->velocity = Bytes(14, 0);
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

TEST_F(AptStageTest, LostHomedBitMeansNotHomed) {
  homed();
  unit_->bits = kAtRest;
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, says(DeviceErrc::NotHomed, "switched off"));
  EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_ABSOLUTE), 0);
  unit_->stand_at(0.0);  // what it says later does not bring it back
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::NotHomed));
}

TEST_F(AptStageTest, EveryAlarmBitIsAFault) {
  homed();
  for (const auto& [bit, words] : {std::pair(status::kOverload, "overload"),
                                   std::pair(status::kPositionError, "position error"),
                                   std::pair(status::kOverheat, "overheated")}) {
    unit_->stand_at(0.0, bit);
    EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, says(DeviceErrc::Fault, words));
    EXPECT_THAT([&] { stage_->home(1min); }, says(DeviceErrc::Fault, words));
    stage_->stop();
    EXPECT_THAT([&] { stage_->rearm(); }, says(DeviceErrc::Fault, words));
    unit_->stand_at(0.0);
    stage_->rearm();
    homed();
  }
  EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_ABSOLUTE), 0);
}

// Half of one message with the next behind it, as a torn transfer leaves it, has no checksum that
// would tell.
TEST_F(AptStageTest, AlarmThatIsNotSaidTwiceIsNoFault) {
  homed();
  int asked = 0;
  unit_->on_message = [&](MessageId id) {
    if (id != MessageId::MOT_REQ_DCSTATUSUPDATE) return;
    unit_->stand_at(0.0, ++asked == 1 ? status::kOverload : 0);
  };
  EXPECT_NO_THROW(stage_->begin_move_to(20.0_deg));
  EXPECT_EQ(unit_->count(MessageId::MOT_MOVE_ABSOLUTE), 1);
}

TEST_F(AptStageTest, LimitBitIsTheHomeSwitchNearHomeAndAFaultElsewhere) {
  homed();
  unit_->stand_at(1.0, status::kReverseLimit);
  EXPECT_NO_THROW(stage_->begin_move_to(20.0_deg));
  unit_->stand_at(5.0, status::kForwardLimit);
  EXPECT_THAT([&] { stage_->wait_until_settled(1min); },
              says(DeviceErrc::Fault, "forward limit switch"));
}

TEST_F(AptStageTest, StopSendsTheImmediateStopAndNothingMovesUntilRearmed) {
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

TEST_F(AptStageTest, StopThatIsIgnoredIsAFaultAndKeepsTheLatch) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(5.0, status::kMovingForward);
  stage_->stop();
  EXPECT_THAT([&] { stage_->rearm(); }, says(DeviceErrc::Fault, "ignored stop"));
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::Stopped));
}

TEST_F(AptStageTest, StopThatWasLostIsRepeatedWhenRearmed) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(5.0, status::kMovingForward);
  stage_->stop();
  unit_->on_message = [&](MessageId id) {
    if (id == MessageId::MOT_MOVE_STOP) unit_->stand_at(6.0);
  };
  EXPECT_NO_THROW(stage_->rearm());
}

TEST_F(AptStageTest, StopThatComesWhileTheOneBeforeIsRearmedStaysLatched) {
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

TEST_F(AptStageTest, UnpluggedItIsNotHomedAndHomeReconnectsAndSetsUp) {
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

TEST_F(AptStageTest, AcknowledgesStatusLongBeforeTheUnitFallsSilent) {
  homed();
  stage_->begin_move_to(20.0_deg);
  unit_->stand_at(5.0, status::kMovingForward);
  EXPECT_THAT([&] { stage_->wait_until_settled(5s); }, ThrowsDeviceError(DeviceErrc::Timeout));
  const auto asked = unit_->count(MessageId::MOT_REQ_DCSTATUSUPDATE);
  const auto acknowledged = unit_->count(MessageId::MOT_ACK_DCSTATUSUPDATE);
  EXPECT_GT(asked, 100);
  EXPECT_GE(acknowledged, asked / 50);
}

TEST_F(AptStageTest, GarbageBeforeAnAnswerCostsNothing) {
  homed();
  unit_->on_message = [&](MessageId id) {
    if (id == MessageId::MOT_REQ_DCSTATUSUPDATE) unit_->say({0xFF, 0x91, 0x04, 0x33});
  };
  EXPECT_NO_THROW(stage_->begin_move_to(20.0_deg));
}

TEST_F(AptStageTest, UnansweredQuestionIsAskedThreeTimes) {
  homed();
  unit_->answers_status = false;
  unit_->sent.clear();
  EXPECT_THAT([&] { stage_->begin_move_to(20.0_deg); }, ThrowsDeviceError(DeviceErrc::Timeout));
  EXPECT_EQ(unit_->count(MessageId::MOT_REQ_DCSTATUSUPDATE), 3);
}

}  // namespace
}  // namespace gonio::apt_stage
