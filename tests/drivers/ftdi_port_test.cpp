#include "gonio/usb_bus/ftdi_port.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <memory>
#include <stdexcept>

#include "../contracts/throws_device_error.h"
#include "fake_usb_device.h"

namespace gonio::usb_bus {
namespace {

using contracts::ThrowsDeviceError;
using devices::DeviceErrc;
using testing::ElementsAre;
using testing::ElementsAreArray;
using namespace std::chrono_literals;
using Bytes = FakeUsbDevice::Bytes;

constexpr std::uint8_t kModem = 0x01;
constexpr std::uint8_t kLine = 0x60;

/// What the setup packet of a control transfer is on the wire, without the length.
std::array<std::uint8_t, 6> on_the_wire(const ControlSetup& setup) {
  return {setup.request_type,
          setup.request,
          static_cast<std::uint8_t>(setup.value),
          static_cast<std::uint8_t>(setup.value >> 8U),
          static_cast<std::uint8_t>(setup.index),
          static_cast<std::uint8_t>(setup.index >> 8U)};
}

class FtdiPortTest : public testing::Test {
 protected:
  FtdiPortTest() : device_(std::make_shared<FakeUsbDevice>()), port_(device_, {50ms, 2, 0ms}) {}

  Bytes read_some(std::size_t most = 512) {
    Bytes bytes(most);
    bytes.resize(port_.read(bytes, 0ms));
    return bytes;
  }

  std::shared_ptr<FakeUsbDevice> device_;
  FtdiPort port_;
};

// Captured from libftdi 1.5 setting up an FT232R in the same way.
TEST_F(FtdiPortTest, SetsTheLineUpByteForByteAsLibftdiDoes) {
  std::vector<std::array<std::uint8_t, 6>> packets;
  for (const ControlSetup& setup : device_->controls) packets.push_back(on_the_wire(setup));
  EXPECT_THAT(packets, ElementsAre(ElementsAre(0x40, 0x00, 0x00, 0x00, 0x01, 0x00),    // reset
                                   ElementsAre(0x40, 0x03, 0x1A, 0x00, 0x00, 0x00),    // 115200
                                   ElementsAre(0x40, 0x04, 0x08, 0x00, 0x01, 0x00),    // 8N1
                                   ElementsAre(0x40, 0x09, 0x02, 0x00, 0x01, 0x00),    // 2 ms
                                   ElementsAre(0x40, 0x00, 0x01, 0x00, 0x01, 0x00),    // purge rx
                                   ElementsAre(0x40, 0x00, 0x02, 0x00, 0x01, 0x00),    // purge tx
                                   ElementsAre(0x40, 0x02, 0x00, 0x00, 0x01, 0x01),    // RTS/CTS
                                   ElementsAre(0x40, 0x01, 0x02, 0x02, 0x01, 0x00)));  // RTS
}

TEST_F(FtdiPortTest, SendsBytesAsTheyAre) {
  port_.write(Bytes{1, 2, 3});
  EXPECT_THAT(device_->sent, ElementsAre(Bytes{1, 2, 3}));
}

TEST_F(FtdiPortTest, TakesTheStatusOutOfEveryPacket) {
  Bytes transfer;
  Bytes expected;
  for (std::size_t packet = 0; packet < 3; ++packet) {
    transfer.insert(transfer.end(), {kModem, kLine});
    for (std::uint8_t byte = 0; byte < (packet < 2 ? 62 : 5); ++byte) {
      transfer.push_back(byte);
      expected.push_back(byte);
    }
  }
  device_->to_give = {transfer};
  EXPECT_EQ(read_some(), expected);
}

TEST_F(FtdiPortTest, HandsOutWhatWasReceivedInAsManyPiecesAsAskedFor) {
  device_->to_give = {{kModem, kLine, 10, 11, 12}};
  EXPECT_THAT(read_some(2), ElementsAre(10, 11));
  EXPECT_THAT(read_some(2), ElementsAre(12));
}

TEST_F(FtdiPortTest, WaitsThroughPacketsThatAreStatusAlone) {
  device_->to_give = {{kModem, kLine}, {kModem, kLine}, {kModem, kLine, 7}};
  Bytes bytes(8);
  EXPECT_EQ(port_.read(bytes, 10s), 1u);
  EXPECT_EQ(bytes[0], 7);
}

TEST_F(FtdiPortTest, ReturnsNothingWhenNothingComes) {
  EXPECT_THAT(read_some(), testing::IsEmpty());
}

TEST_F(FtdiPortTest, LostOrGarbledBytesAreAProtocolError) {
  for (const std::uint8_t error : {kFtdiOverrun, kFtdiParity, kFtdiFraming}) {
    device_->to_give = {{kModem, static_cast<std::uint8_t>(kLine | error), 1, 2}};
    EXPECT_THAT([&] { read_some(); }, ThrowsDeviceError(DeviceErrc::Protocol));
    device_->to_give = {{kModem, kLine, 3}};
    EXPECT_THAT(read_some(), ElementsAre(3));  // and nothing of what was garbled
  }
}

TEST_F(FtdiPortTest, PacketWithoutBothStatusBytesIsAProtocolError) {
  device_->to_give = {{kModem}};
  EXPECT_THAT([&] { read_some(); }, ThrowsDeviceError(DeviceErrc::Protocol));
}

TEST_F(FtdiPortTest, PurgeDropsWhatWasNotRead) {
  device_->to_give = {{kModem, kLine, 1, 2, 3}};
  read_some(1);
  port_.purge();
  EXPECT_THAT(read_some(), testing::IsEmpty());
}

TEST_F(FtdiPortTest, SetsTheLineUpAgainAfterAReconnection) {
  const std::vector<ControlSetup> first = device_->controls;
  device_->controls.clear();
  device_->unplug();
  EXPECT_FALSE(port_.connected());
  EXPECT_THAT([&] { port_.write(Bytes{1}); }, ThrowsDeviceError(DeviceErrc::Disconnected));
  port_.reconnect(1s);
  EXPECT_TRUE(port_.connected());
  EXPECT_THAT(device_->controls, ElementsAreArray(first));
}

TEST_F(FtdiPortTest, SetUpThatFailsLeavesItDisconnectedAndIsDoneAgain) {
  const std::vector<ControlSetup> whole = device_->controls;
  device_->unplug();
  device_->on_control = [](const ControlSetup&) -> Bytes {
    throw devices::DeviceError(DeviceErrc::Timeout, "fake", "no answer");
  };
  EXPECT_THAT([&] { port_.reconnect(1s); }, ThrowsDeviceError(DeviceErrc::Timeout));
  EXPECT_FALSE(port_.connected());
  device_->on_control = nullptr;
  device_->controls.clear();
  port_.reconnect(1s);
  EXPECT_THAT(device_->controls, ElementsAreArray(whole));
}

TEST(FtdiPayload, KeepsTheLineStatusOfAllPackets) {
  Bytes transfer(64, 0);
  transfer[1] = kFtdiParity;
  transfer.insert(transfer.end(), {0x11, kFtdiOverrun, 5});
  const FtdiTransfer parsed = ftdi_payload(transfer);
  EXPECT_EQ(parsed.line_status, kFtdiParity | kFtdiOverrun);
  EXPECT_EQ(parsed.modem_status, 0x11);
  EXPECT_EQ(parsed.payload.size(), 63u);
}

TEST(FtdiPayload, HighSpeedChipsHaveLongerPackets) {
  EXPECT_EQ(ftdi_payload(Bytes(512, 0), 512).payload.size(), 510u);
  EXPECT_EQ(ftdi_payload(Bytes(512, 0), 64).payload.size(), 8u * 62u);
}

}  // namespace
}  // namespace gonio::usb_bus
