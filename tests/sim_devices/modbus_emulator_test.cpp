// The emulated Modbus devices, asked byte by byte and without any driver.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <chrono>

#include "gonio/devices/steady_clock.h"
#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/modbus_emulator/frames.h"
#include "gonio/modbus_emulator/rtu_line.h"
#include "gonio/sim/joint.h"

namespace gonio::modbus_emulator {
namespace {

using namespace std::chrono_literals;

TEST(ModbusFrames, ChecksumIsThatOfTheCatalogue) {
  // CRC-16/MODBUS of "123456789" is 0x4B37.
  const Bytes digits{'1', '2', '3', '4', '5', '6', '7', '8', '9'};
  EXPECT_EQ(crc16(digits), 0x4B37);
  EXPECT_TRUE(crc_fits(with_crc(digits)));
  Bytes damaged = with_crc(digits);
  damaged[3] ^= 1U;
  EXPECT_FALSE(crc_fits(damaged));
}

TEST(ModbusFrames, RequestSaysItsLengthAsSoonAsItCan) {
  EXPECT_FALSE(rtu_request_length(Bytes{1}));
  EXPECT_EQ(rtu_request_length(Bytes{1, 3}), 8U);
  EXPECT_FALSE(rtu_request_length(Bytes{1, 16, 0, 0, 0, 8}));
  EXPECT_EQ(rtu_request_length(Bytes{1, 16, 0, 0, 0, 8, 16}), 25U);
  EXPECT_FALSE(rtu_request_length(Bytes{1, 0x2B, 0, 0, 0, 0, 0, 0}));
}

TEST(ModbusFrames, TcpRequestIsWholeIncompleteOrNone) {
  const Bytes whole{0x12, 0x34, 0, 0, 0, 6, 1, 3, 0, 0, 0, 1};
  TcpRequest request;
  ASSERT_EQ(tcp_request(whole, request), TcpState::whole);
  EXPECT_EQ(request.transaction, 0x1234);
  EXPECT_EQ(request.unit, 1);
  EXPECT_EQ(request.pdu, (Bytes{3, 0, 0, 0, 1}));
  EXPECT_EQ(request.length, 12U);
  for (std::size_t length = 0; length < whole.size(); ++length) {
    EXPECT_EQ(tcp_request({whole.data(), length}, request), TcpState::incomplete);
  }
  Bytes other_protocol = whole;
  other_protocol[2] = 1;
  EXPECT_EQ(tcp_request(other_protocol, request), TcpState::broken);
  Bytes too_long = whole;
  too_long[4] = 0xFF;
  EXPECT_EQ(tcp_request(too_long, request), TcpState::broken);
}

/// Two drives of one line, and a master that only has bytes.
class EmulatedLine : public testing::Test {
 protected:
  EmulatedLine() {
    line_.add(1, leadshine_drive("tilt", mechanics(tilt_), nullptr));
    line_.add(2, az_drive("azimuth", mechanics(azimuth_), nullptr));
    port_ = ::open(line_.port().c_str(), O_RDWR | O_NOCTTY);
  }
  ~EmulatedLine() override { ::close(port_); }

  static rig::Axis axis() {
    rig::Axis axis;
    axis.name = "axis";
    axis.min = Angle::from_degrees(-90.0);
    axis.max = Angle::from_degrees(90.0);
    return axis;
  }
  DriveMechanics mechanics(sim::Joint& joint) { return {&joint, &clock_, Angle(), 1000.0, false}; }

  /// Answers up to a silence of 100 ms.
  Bytes ask(const Bytes& request) {
    EXPECT_EQ(::write(port_, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    Bytes answer;
    pollfd watched{port_, POLLIN, 0};
    while (::poll(&watched, 1, 100) > 0) {
      std::uint8_t byte = 0;
      if (::read(port_, &byte, 1) != 1) break;
      answer.push_back(byte);
    }
    return answer;
  }

  devices::SteadyClock clock_{1000.0};
  sim::Joint tilt_{axis(), {}, 1, 0};
  sim::Joint azimuth_{axis(), {}, 1, 1};
  ModbusRtuLine line_{{}, nullptr, clock_};
  int port_ = -1;
};

TEST_F(EmulatedLine, LeadshineAnswersAsItsManualPrints) {
  // iEM-RS manual p. 20: a request of a wrong checksum, a function it does not know.
  EXPECT_EQ(ask({0x01, 0x03, 0x00, 0x01, 0x00, 0x01, 0xD5, 0xC1}),
            (Bytes{0x01, 0x83, 0x08, 0x40, 0xF6}));
  EXPECT_EQ(ask({0x01, 0x02, 0x00, 0x01, 0x00, 0x01, 0xE8, 0x0A}),
            (Bytes{0x01, 0x82, 0x01, 0x81, 0x60}));
}

TEST_F(EmulatedLine, EveryUnitAnswersForItselfAndNobodyForOthers) {
  EXPECT_EQ(ask(with_crc({1, 3, 0, 1, 0, 1})), with_crc({1, 3, 2, 0x27, 0x10}));
  EXPECT_EQ(ask(with_crc({2, 8, 0, 0, 0xA5, 0x37})), with_crc({2, 8, 0, 0, 0xA5, 0x37}));
  EXPECT_EQ(ask(with_crc({3, 3, 0, 1, 0, 1})), Bytes{});
  EXPECT_EQ(ask({2, 3, 0, 0x7F, 0, 1, 0, 0}), Bytes{});  // an AZ says nothing to damage
}

TEST_F(EmulatedLine, FindsTheNextRequestAfterRubbish) {
  EXPECT_EQ(ask({0xFF, 0x2B, 0x00}), Bytes{});
  EXPECT_EQ(ask(with_crc({1, 3, 0, 1, 0, 1})), with_crc({1, 3, 2, 0x27, 0x10}));
}

TEST_F(EmulatedLine, DrivesRefuseWhatTheyDoNotHave) {
  EXPECT_EQ(ask(with_crc({1, 3, 0x50, 0, 0, 1})), with_crc({1, 0x83, 2}));
  EXPECT_EQ(ask(with_crc({1, 6, 0x10, 0x03, 0, 1})), with_crc({1, 0x86, 2}));  // read only
  EXPECT_EQ(ask(with_crc({2, 3, 0, 0x7F, 0, 126})), with_crc({2, 0x83, 3}));
  EXPECT_EQ(ask(with_crc({2, 4, 0, 0x7F, 0, 1})), with_crc({2, 0x84, 1}));
}

TEST_F(EmulatedLine, PositionsCountFromPowerUpUntilHomed) {
  const Bytes read_position = with_crc({1, 3, 0x10, 0x14, 0, 2});
  EXPECT_EQ(ask(read_position), with_crc({1, 3, 4, 0, 0, 0, 0}));  // wherever it stands
  EXPECT_NE(tilt_.encoder(clock_.now()).degrees(), 0.0);
  ask(with_crc({1, 6, 0x60, 0x02, 0, 0x20}));
  clock_.wait_until(tilt_.settled_at());
  EXPECT_EQ(ask(with_crc({1, 3, 0x10, 0x03, 0, 1})), with_crc({1, 3, 2, 0, 0x72}));
  // 1000 steps, one degree from the home mark at 0, at 60 rpm and 100 ms to 1000 rpm.
  ask(with_crc(
      {1, 0x10, 0x62, 0, 0, 8, 16, 0, 1, 0, 0, 0x03, 0xE8, 0, 60, 0, 100, 0, 100, 0, 0, 0, 0x10}));
  clock_.wait_until(tilt_.settled_at());
  EXPECT_NEAR(tilt_.encoder(clock_.now()).degrees(), 1.0, 0.006);
}

}  // namespace
}  // namespace gonio::modbus_emulator
