#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "../contracts/throws_device_error.h"
#include "gonio/apt_stage/apt_stage.h"

namespace gonio::apt_stage {

inline constexpr double kStepsPerDeg = 49152000.0 / 360.0;
inline constexpr std::uint32_t kAtRest = status::kConnected | status::kEnabled | status::kPowerOk;

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
  void disconnect() noexcept override { connected_ = false; }
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
        info[0] = serial;
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

  std::size_t read(std::span<std::uint8_t> room, Deadline deadline) override {
    require_connected();
    if (on_read) on_read(deadline);
    if (chatter_until) {
      if (std::chrono::steady_clock::now() > *chatter_until)
        throw std::logic_error("read for ever");
      room[0] = 0xFF;
      return 1;
    }
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
  std::uint8_t serial = 42;
  bool takes_settings = true;
  bool answers_status = true;
  std::int32_t position = 0;
  std::uint32_t bits = kAtRest;
  Bytes velocity = Bytes(14, 0);
  Bytes home = Bytes(14, 0);
  std::vector<MessageId> sent;
  Bytes last;
  std::function<void(MessageId)> on_message;
  std::function<void(Deadline)> on_read;
  std::optional<std::chrono::steady_clock::time_point> chatter_until;  ///< garbage without end
  int reconnections = 0;

 private:
  void require_connected() const {
    if (!connected_)
      throw devices::DeviceError(devices::DeviceErrc::Disconnected, name_, "unplugged");
  }
  std::string name_ = "azimuth";
  bool connected_ = true;
  std::deque<std::uint8_t> to_host_;
};

class AptStageTest : public testing::Test {
 protected:
  AptStageTest() : unit_(std::make_shared<RecordingUnit>()) { open(); }

  void open(bool reversed = false, HomeDirection direction = HomeDirection::falling) {
    using namespace gonio::literals;
    stage_ = std::make_unique<AptStage>(unit_,
                                        devices::AxisSetup{"azimuth",
                                                           {-170.0_deg, 170.0_deg},
                                                           10.0_deg,
                                                           10.0,
                                                           20.0,
                                                           std::chrono::milliseconds(500)},
                                        k10cr1(), reversed, clock_, direction);
  }

  void homed() {
    unit_->on_message = [this](MessageId id) {
      if (id != MessageId::MOT_MOVE_HOME) return;
      unit_->stand_at(0.0);
      unit_->say({0x44, 0x04, 0x01, 0x00, 0x01, 0x50});
    };
    stage_->home(std::chrono::minutes(1));
    unit_->on_message = nullptr;
  }

  static auto says(devices::DeviceErrc code, const std::string& words) {
    return testing::Throws<devices::DeviceError>(testing::AllOf(
        testing::Property("code", &devices::DeviceError::code, code),
        testing::Property("what", &devices::DeviceError::what, testing::HasSubstr(words))));
  }

  WaitedClock clock_;
  std::shared_ptr<RecordingUnit> unit_;
  std::unique_ptr<AptStage> stage_;
};

}  // namespace gonio::apt_stage
