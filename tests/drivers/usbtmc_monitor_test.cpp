// The monitor over a recording device; over a real bus it runs in tests/contracts.

#include "gonio/usbtmc_monitor/usbtmc_monitor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <deque>
#include <memory>
#include <string>

#include "../contracts/throws_device_error.h"
#include "fake_usb_device.h"
#include "usbtmc_answer.h"

namespace gonio::usbtmc_monitor {
namespace {

using contracts::ThrowsDeviceError;
using devices::DeviceErrc;
using devices::DeviceError;
using testing::AllOf;
using testing::HasSubstr;
using testing::Property;
using testing::Throws;
using namespace std::chrono_literals;

constexpr std::uint8_t kAbortIn = 3;
constexpr std::uint8_t kCheckAbortIn = 4;
constexpr std::uint8_t kClear = 5;
constexpr std::uint8_t kCheckClear = 6;

class UsbtmcMonitorTest : public testing::Test {
 protected:
  UsbtmcMonitorTest() : device_(std::make_shared<usb_bus::FakeUsbDevice>()) {
    device_->on_control = [this](const usb_bus::ControlSetup& setup) {
      requests_.push_back(setup.request);
      Bytes reply(8, 0);
      reply[0] =
          pending_ > 0 && (setup.request == kCheckAbortIn || setup.request == kCheckClear) ? 2 : 1;
      pending_ -= reply[0] == 2 ? 1 : 0;
      return reply;
    };
    device_->on_sent = [this](const Bytes& bytes) {
      if (bytes[0] == 1) {
        command_.assign(bytes.begin() + 12, bytes.begin() + 12 + bytes[4]);
        ++queries_;
      } else if (bytes[0] == 2) {
        const std::uint8_t tag = bytes[1];
        tags_.push_back(tag);
        if (command_ == "*IDN?\n") {
          device_->to_give.push_back(answer(tag, "Acme,P1," + serial_ + ",1.0\n"));
        } else if (!answers_.empty()) {
          const auto give = answers_.front();
          answers_.pop_front();
          give(tag);
        }
      }
    };
    monitor_ = std::make_unique<UsbtmcMonitor>(device_, MonitorOptions{"READ?", 0.0, 200ms},
                                               [this] { return now_; });
    requests_.clear();
    queries_ = 0;
  }

  /// For one request each, in this order.
  void will_answer(const std::string& text) {
    answers_.emplace_back(
        [=, this](std::uint8_t tag) { device_->to_give.push_back(answer(tag, text)); });
  }
  void will_not_answer() {
    answers_.emplace_back([](std::uint8_t) {});
  }

  static auto says(DeviceErrc code, const std::string& words) {
    return Throws<DeviceError>(AllOf(Property("code", &DeviceError::code, code),
                                     Property("what", &DeviceError::what, HasSubstr(words))));
  }

  std::shared_ptr<usb_bus::FakeUsbDevice> device_;
  std::unique_ptr<UsbtmcMonitor> monitor_;
  std::deque<std::function<void(std::uint8_t)>> answers_;
  std::string command_;
  std::string serial_ = "7";
  std::chrono::steady_clock::time_point now_{};  ///< passes only where a test lets it
  std::vector<std::uint8_t> tags_;
  std::vector<std::uint8_t> requests_;
  int queries_ = 0;
  int pending_ = 0;
};

TEST_F(UsbtmcMonitorTest, SaysWhoItIs) {
  EXPECT_EQ(monitor_->identity().manufacturer, "Acme");
  EXPECT_EQ(monitor_->identity().model, "P1");
  EXPECT_EQ(monitor_->identity().serial, "7");
  EXPECT_EQ(monitor_->identity().firmware, "1.0");
}

TEST_F(UsbtmcMonitorTest, AsksAndReturnsTheNumberLessItsZero) {
  will_answer("1.25E+00\n");
  EXPECT_EQ(monitor_->read(), 1.25);
  EXPECT_EQ(command_, "READ?\n");
  UsbtmcMonitor shifted(device_, {"READ?", 0.25, 200ms});
  will_answer("1.25\n");
  EXPECT_EQ(shifted.read(), 1.0);
}

TEST_F(UsbtmcMonitorTest, NeverUsesATagTwiceInARow) {
  for (int reading = 0; reading < 300; ++reading) {
    will_answer("1\n");
    monitor_->read();
  }
  EXPECT_EQ(std::adjacent_find(tags_.begin(), tags_.end()), tags_.end());
  EXPECT_THAT(tags_, testing::Not(testing::Contains(0)));
}

TEST_F(UsbtmcMonitorTest, LateAnswerOfAnEarlierRequestIsDropped) {
  answers_.emplace_back([this](std::uint8_t tag) {
    device_->to_give.push_back(answer(static_cast<std::uint8_t>(tag - 2), "111\n"));
    device_->to_give.push_back(answer(tag, "2\n"));
  });
  EXPECT_EQ(monitor_->read(), 2.0);
}

TEST_F(UsbtmcMonitorTest, LateAnswerAloneIsNoAnswer) {
  for (int attempt = 0; attempt < UsbtmcMonitor::kAttempts; ++attempt) {
    answers_.emplace_back([this](std::uint8_t tag) {
      device_->to_give.push_back(answer(static_cast<std::uint8_t>(tag - 2), "111\n"));
    });
  }
  EXPECT_THAT([&] { monitor_->read(); }, ThrowsDeviceError(DeviceErrc::Timeout));
}

TEST_F(UsbtmcMonitorTest, AnswersOfSeveralTransfersAndSeveralReadsAreOne) {
  const std::string digits = "1." + std::string(150, '0');
  answers_.emplace_back([=, this](std::uint8_t tag) {
    const Bytes whole = answer(tag, digits, false);  // 164 bytes: two full packets and a rest
    device_->to_give.emplace_back(whole.begin(), whole.begin() + 64);
    device_->to_give.emplace_back(whole.begin() + 64, whole.begin() + 128);
    device_->to_give.emplace_back(whole.begin() + 128, whole.end());
  });
  will_answer("5E0\n");
  EXPECT_NEAR(monitor_->read(), 1.0, 1e-12);
  EXPECT_EQ(queries_, 1);
}

TEST_F(UsbtmcMonitorTest, TransferThatEndsEarlyIsAskedForAgain) {
  answers_.emplace_back([this](std::uint8_t tag) {
    Bytes torn = answer(tag, "1.25\n");
    torn.resize(14);
    device_->to_give.push_back(torn);
  });
  will_answer("3\n");
  EXPECT_EQ(monitor_->read(), 3.0);
  EXPECT_EQ(queries_, 2);
}

TEST_F(UsbtmcMonitorTest, TimeoutAbortsTheAnswerAndClearsTheInstrument) {
  will_not_answer();
  will_answer("3\n");
  EXPECT_EQ(monitor_->read(), 3.0);
  EXPECT_THAT(requests_, testing::ElementsAre(kAbortIn, kCheckAbortIn, kClear, kCheckClear));
  const auto abort =
      std::find_if(device_->controls.rbegin(), device_->controls.rend(),
                   [](const usb_bus::ControlSetup& setup) { return setup.request == kAbortIn; });
  ASSERT_NE(abort, device_->controls.rend());
  EXPECT_EQ(abort->request_type, 0xA2);
  EXPECT_EQ(abort->value, tags_[tags_.size() - 2]);  // the tag of the request that had no answer
  EXPECT_EQ(abort->index, device_->layout_.bulk_in);
  EXPECT_THAT(device_->cleared, testing::Contains(usb_bus::Direction::out));
}

TEST_F(UsbtmcMonitorTest, WaitsWhileAClearIsPending) {
  will_not_answer();
  will_answer("3\n");
  pending_ = 3;
  EXPECT_EQ(monitor_->read(), 3.0);
  EXPECT_GT(std::count(requests_.begin(), requests_.end(), kCheckAbortIn) +
                std::count(requests_.begin(), requests_.end(), kCheckClear),
            4);
}

TEST_F(UsbtmcMonitorTest, SilentInstrumentIsAskedThreeTimes) {
  EXPECT_THAT([&] { monitor_->read(); }, ThrowsDeviceError(DeviceErrc::Timeout));
  EXPECT_EQ(queries_, UsbtmcMonitor::kAttempts + 1);  // and once for its error
}

TEST_F(UsbtmcMonitorTest, AnswerThatIsNoNumberIsNeverAReading) {
  for (const char* const text : {"nan\n", "ready\n", "1.5 W\n", "\n"}) {
    answers_.clear();
    for (int attempt = 0; attempt < UsbtmcMonitor::kAttempts; ++attempt) will_answer(text);
    EXPECT_THAT([&] { monitor_->read(); }, says(DeviceErrc::Protocol, "expected a number"));
  }
}

TEST_F(UsbtmcMonitorTest, OutOfRangeIsAFaultAtOnce) {
  will_answer("9.91E37\n");
  EXPECT_THAT([&] { monitor_->read(); }, says(DeviceErrc::Fault, "out of range"));
  EXPECT_EQ(queries_, 1);
}

TEST_F(UsbtmcMonitorTest, InstrumentsOwnErrorIsAFault) {
  for (int attempt = 0; attempt < UsbtmcMonitor::kAttempts; ++attempt) will_not_answer();
  will_answer("-113,\"Undefined header\"\n");
  EXPECT_THAT([&] { monitor_->read(); }, says(DeviceErrc::Fault, "-113, \"Undefined header\""));
}

TEST_F(UsbtmcMonitorTest, UnpluggedItIsLookedForAtTheNextReading) {
  device_->unplug();
  will_answer("4\n");
  EXPECT_EQ(monitor_->read(), 4.0);
  EXPECT_EQ(device_->reconnections, 1);
}

TEST_F(UsbtmcMonitorTest, AnotherInstrumentInItsPlaceIsRefusedAgainAndAgain) {
  device_->unplug();
  serial_ = "8";
  for (int attempt = 1; attempt <= 2; ++attempt) {
    will_answer("4\n");
    EXPECT_THAT([&] { monitor_->read(); }, says(DeviceErrc::Protocol, "7 came back as 8"));
    EXPECT_EQ(device_->reconnections, attempt);
  }
  EXPECT_EQ(monitor_->identity().serial, "7");
  serial_ = "7";
  EXPECT_EQ(monitor_->read(), 4.0);
}

// Every transfer takes nearly all the time it is given, and no recovery ever ends.
TEST_F(UsbtmcMonitorTest, ReadingEndsInTimeHoweverSlowTheInstrument) {
  device_->on_deadline = [this](usb_bus::UsbDevice::Deadline deadline) { now_ += deadline - 1us; };
  pending_ = 1 << 30;
  const auto begun = now_;
  EXPECT_THAT([&] { monitor_->read(); }, ThrowsDeviceError(DeviceErrc::Timeout));
  EXPECT_LE(now_ - begun,
            (UsbtmcMonitor::kAttempts + 1) * 200ms + UsbtmcMonitor::kRecovery + 300ms);
  device_->on_deadline = nullptr;
  pending_ = 0;
  requests_.clear();
  will_answer("4\n");
  EXPECT_EQ(monitor_->read(), 4.0);
  EXPECT_THAT(requests_, testing::Contains(kClear));  // what there was no time for
}

TEST_F(UsbtmcMonitorTest, OptionsThatCannotBeAreRefused) {
  EXPECT_THROW(UsbtmcMonitor(device_, {"", 0.0, 200ms}), std::invalid_argument);
  EXPECT_THROW(UsbtmcMonitor(device_, {"READ?", std::nan(""), 200ms}), std::invalid_argument);
  EXPECT_THROW(UsbtmcMonitor(device_, {"READ?", 0.0, 0ms}), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::usbtmc_monitor
