#include "gonio/apt_stage/apt_messages.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "gonio/apt_stage/apt_decoder.h"
#include "gonio/apt_stage/apt_model.h"

namespace gonio::apt_stage {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// The first two are printed in the documentation of the Python package thorlabs-apt-protocol; the
// others are laid out by hand from the protocol document, issue 25.
TEST(AptMessages, AreTheBytesOfTheDocument) {
  EXPECT_THAT(move_home(), ElementsAre(0x43, 0x04, 0x01, 0x00, 0x50, 0x01));
  EXPECT_THAT(move_absolute(2048),
              ElementsAre(0x53, 0x04, 0x06, 0x00, 0xD0, 0x01, 0x01, 0x00, 0x00, 0x08, 0x00, 0x00));
  EXPECT_THAT(short_message(MessageId::HW_REQ_INFO),
              ElementsAre(0x05, 0x00, 0x00, 0x00, 0x50, 0x01));
  EXPECT_THAT(short_message(MessageId::HW_STOP_UPDATEMSGS),
              ElementsAre(0x12, 0x00, 0x00, 0x00, 0x50, 0x01));
  EXPECT_THAT(enable_channel(true), ElementsAre(0x10, 0x02, 0x01, 0x01, 0x50, 0x01));
  EXPECT_THAT(enable_channel(false), ElementsAre(0x10, 0x02, 0x01, 0x02, 0x50, 0x01));
  EXPECT_THAT(move_stop(StopMode::immediate), ElementsAre(0x65, 0x04, 0x01, 0x01, 0x50, 0x01));
  EXPECT_THAT(move_stop(StopMode::profiled), ElementsAre(0x65, 0x04, 0x01, 0x02, 0x50, 0x01));
  EXPECT_THAT(request_status(), ElementsAre(0x90, 0x04, 0x01, 0x00, 0x50, 0x01));
  EXPECT_THAT(acknowledge_status(), ElementsAre(0x92, 0x04, 0x00, 0x00, 0x50, 0x01));
}

TEST(AptMessages, NegativePositionsAreTwosComplementLowByteFirst) {
  EXPECT_THAT(move_absolute(-1000),
              ElementsAre(0x53, 0x04, 0x06, 0x00, 0xD0, 0x01, 0x01, 0x00, 0x18, 0xFC, 0xFF, 0xFF));
}

TEST(AptMessages, VelocityParamsHaveMinimumAccelerationMaximum) {
  EXPECT_THAT(set_velocity({0, 0x7558, 0x045E5552}),
              ElementsAre(0x13, 0x04, 0x0E, 0x00, 0xD0, 0x01, 0x01, 0x00, 0, 0, 0, 0, 0x58, 0x75, 0,
                          0, 0x52, 0x55, 0x5E, 0x04));
}

TEST(AptMessages, HomeParamsHaveDirectionSwitchVelocityOffset) {
  EXPECT_THAT(set_home({2, 1, 0x01020304, -2}),
              ElementsAre(0x40, 0x04, 0x0E, 0x00, 0xD0, 0x01, 0x01, 0x00, 2, 0, 1, 0, 0x04, 0x03,
                          0x02, 0x01, 0xFE, 0xFF, 0xFF, 0xFF));
}

TEST(AptMessages, K10cr1CountsAsItsSpecificationSays) {
  const AptModel model = k10cr1();
  EXPECT_NEAR(model.steps_per_deg * 360.0, 49152000.0, 1e-3);
  // 53.68 and 1/90.9 of the microsteps, as the document rounds them.
  EXPECT_NEAR(model.velocity_per_deg_s / model.steps_per_deg, 53.68, 0.005);
  EXPECT_NEAR(model.steps_per_deg / model.acceleration_per_deg_s2, 90.9, 0.05);
  EXPECT_NO_THROW(model.validate());
}

TEST(AptMessages, ModelsThatCannotBeAreRefused) {
  AptModel model = k10cr1();
  model.steps_per_deg = 0.0;
  EXPECT_THAT([&] { model.validate(); },
              testing::ThrowsMessage<std::invalid_argument>(HasSubstr("steps_per_deg")));
}

Message from_unit(MessageId id, Bytes data) {
  Message message;
  message.id = static_cast<std::uint16_t>(id);
  message.destination = kHost;
  message.source = kUnit;
  message.data = std::move(data);
  return message;
}

Bytes information() {
  Bytes data(84, 0);
  const Bytes serial_and_model{0x78, 0x4C, 0x47, 0x03, 'K', '1', '0', 'C', 'R', '1', 0, 0};
  std::copy(serial_and_model.begin(), serial_and_model.end(), data.begin());
  data[12] = 44;
  data[14] = 3;  // firmware: minor, interim, major
  data[15] = 0;
  data[16] = 1;
  data[78] = 2;
  data[82] = 1;
  return data;
}

TEST(AptMessages, HardwareInformationIsTakenApart) {
  const auto info = hardware_info(from_unit(MessageId::HW_GET_INFO, information()));
  ASSERT_TRUE(info.has_value());
  EXPECT_EQ(info->serial, 55004280u);
  EXPECT_EQ(info->model, "K10CR1");
  EXPECT_EQ(info->type, 44);
  EXPECT_EQ(info->firmware, "1.0.3");
  EXPECT_EQ(info->hardware_version, 2);
  EXPECT_EQ(info->channels, 1);
}

TEST(AptMessages, ModelNameIsMadePrintable) {
  Bytes data = information();
  data[5] = 0x1B;
  EXPECT_EQ(hardware_info(from_unit(MessageId::HW_GET_INFO, data))->model, "K?0CR1");
}

TEST(AptMessages, StatusIsTakenApart) {
  const Bytes data{1, 0, 0x18, 0xFC, 0xFF, 0xFF, 0x34, 0x12, 0, 0, 0x10, 0x04, 0x00, 0x80};
  for (const MessageId id : {MessageId::MOT_GET_DCSTATUSUPDATE, MessageId::MOT_MOVE_COMPLETED,
                             MessageId::MOT_MOVE_STOPPED}) {
    const auto update = status_update(from_unit(id, data));
    ASSERT_TRUE(update.has_value());
    EXPECT_EQ(update->position, -1000);
    EXPECT_EQ(update->velocity, 0x1234);
    EXPECT_EQ(update->bits, status::kMovingForward | status::kHomed | status::kEnabled);
    EXPECT_EQ(describe_status(update->bits), "moving forward, homed, enabled");
  }
}

TEST(AptMessages, OtherLengthsAndOtherMessagesAreNotTakenApart) {
  EXPECT_FALSE(status_update(from_unit(MessageId::MOT_GET_DCSTATUSUPDATE, Bytes(13))));
  EXPECT_FALSE(status_update(from_unit(MessageId::MOT_GET_VELPARAMS, Bytes(14))));
  EXPECT_FALSE(hardware_info(from_unit(MessageId::HW_GET_INFO, Bytes(83))));
  EXPECT_FALSE(home_params(from_unit(MessageId::MOT_GET_HOMEPARAMS, Bytes(12))));
}

std::vector<Message> three_messages() {
  Message homed;
  homed.id = static_cast<std::uint16_t>(MessageId::MOT_MOVE_HOMED);
  homed.param1 = 1;
  homed.destination = kHost;
  homed.source = kUnit;
  return {from_unit(MessageId::HW_GET_INFO, information()), homed,
          from_unit(MessageId::MOT_GET_DCSTATUSUPDATE, Bytes(14, 0xAB))};
}

Bytes stream_of(const std::vector<Message>& messages) {
  Bytes stream;
  for (const Message& message : messages) {
    const Bytes bytes = encode(message);
    stream.insert(stream.end(), bytes.begin(), bytes.end());
  }
  return stream;
}

std::vector<Message> drain(AptDecoder& decoder) {
  std::vector<Message> messages;
  while (auto message = decoder.next()) messages.push_back(*message);
  return messages;
}

TEST(AptDecoder, FindsTheSameMessagesHoweverTheBytesCome) {
  const std::vector<Message> sent = three_messages();
  const Bytes stream = stream_of(sent);
  for (std::size_t piece = 1; piece <= stream.size(); ++piece) {
    AptDecoder decoder;
    std::vector<Message> found;
    for (std::size_t begin = 0; begin < stream.size(); begin += piece) {
      decoder.feed(std::span(stream).subspan(begin, std::min(piece, stream.size() - begin)));
      const auto more = drain(decoder);
      found.insert(found.end(), more.begin(), more.end());
    }
    EXPECT_EQ(found, sent) << piece;
    EXPECT_EQ(decoder.pending(), 0u);
    EXPECT_EQ(decoder.skipped(), 0u);
  }
}

TEST(AptDecoder, SkipsGarbageBeforeAMessage) {
  std::mt19937 random(1);
  const std::vector<Message> sent = three_messages();
  const Bytes stream = stream_of(sent);
  for (int trial = 0; trial < 200; ++trial) {
    Bytes bytes(static_cast<std::size_t>(trial % 40));
    // Bytes that cannot be the address of the host.
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(2 + random() % 100);
    const std::size_t garbage = bytes.size();
    bytes.insert(bytes.end(), stream.begin(), stream.end());
    AptDecoder decoder;
    decoder.feed(bytes);
    EXPECT_EQ(drain(decoder), sent);
    EXPECT_EQ(decoder.skipped(), garbage);
  }
}

TEST(AptDecoder, MessageWithoutItsBeginningCostsNoOther) {
  const std::vector<Message> sent = three_messages();
  const Bytes stream = stream_of(sent);
  const std::size_t first = encode(sent[0]).size();
  for (std::size_t lost = 1; lost < first; ++lost) {
    AptDecoder decoder;
    decoder.feed(std::span(stream).subspan(lost));
    EXPECT_THAT(drain(decoder), testing::Contains(sent[2])) << lost;
  }
}

TEST(AptDecoder, WaitsForTheEndOfAMessageAndForgetsItWhenCleared) {
  AptDecoder decoder;
  const Bytes status = encode(three_messages()[2]);
  decoder.feed(std::span(status).first(10));
  EXPECT_FALSE(decoder.next());
  EXPECT_EQ(decoder.pending(), 10u);
  decoder.clear();
  decoder.feed(status);
  EXPECT_EQ(drain(decoder).size(), 1u);
}

TEST(AptDecoder, RefusesHeadersThatCannotBe) {
  const Bytes refused[] = {
      {0x91, 0x04, 0x0E, 0x00, 0xD0, 0x50},  // to the unit
      {0x91, 0x04, 0x0E, 0x00, 0x81, 0x07},  // from nobody
      {0x91, 0x04, 0x0D, 0x00, 0x81, 0x50},  // known, but of another length
      {0x91, 0x04, 0x01, 0x00, 0x01, 0x50},  // known, but without its data
      {0x44, 0x04, 0x02, 0x00, 0x81, 0x50},  // known, but with data
      {0x99, 0x09, 0x00, 0x00, 0x81, 0x50},  // data of no length
      {0x99, 0x09, 0x00, 0x01, 0x81, 0x50},  // more data than any message has
  };
  for (const Bytes& header : refused) {
    AptDecoder decoder;
    decoder.feed(header);
    EXPECT_FALSE(decoder.next());
    EXPECT_GT(decoder.skipped(), 0u);
  }
}

TEST(AptDecoder, MessagesItDoesNotKnowAreHandedOutWhole) {
  AptDecoder decoder;
  decoder.feed(Bytes{0x99, 0x09, 0x02, 0x00, 0x81, 0x50, 7, 8});
  const auto message = decoder.next();
  ASSERT_TRUE(message.has_value());
  EXPECT_EQ(message->id, 0x0999);
  EXPECT_THAT(message->data, ElementsAre(7, 8));
}

}  // namespace
}  // namespace gonio::apt_stage
