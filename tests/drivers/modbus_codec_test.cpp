// Requests and answers of Modbus as bytes, without their checksums: what libmodbus adds is tested
// on the wire (tests/contracts).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <stdexcept>

#include "gonio/modbus_bus/modbus_bus.h"
#include "gonio/modbus_bus/request.h"

namespace gonio::modbus_bus {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = Answer::Kind;
using testing::ElementsAre;
using testing::HasSubstr;

struct Golden {
  const char* source;
  int unit;
  Request request;
  Bytes sent;
  Bytes answer;
  std::vector<std::uint16_t> words;
};

const std::vector<Golden>& goldens() {
  static const std::vector<Golden> kGoldens{
      {"CS2RS manual p. 50, PR0",
       7,
       write_registers(0x6200, {1, 0, 10000, 0, 10000, 10000, 0, 0x10}),
       {0x07, 0x10, 0x62, 0x00, 0x00, 0x08, 0x10, 0x00, 0x01, 0x00, 0x00, 0x27,
        0x10, 0x00, 0x00, 0x27, 0x10, 0x27, 0x10, 0x00, 0x00, 0x00, 0x10},
       {0x07, 0x10, 0x62, 0x00, 0x00, 0x08},
       {}},
      {"iEM-RS manual, control word",
       1,
       write_register(0x1801, 0x2211),
       {0x01, 0x06, 0x18, 0x01, 0x22, 0x11},
       {0x01, 0x06, 0x18, 0x01, 0x22, 0x11},
       {}},
      {"iEM-RS manual, two inputs",
       1,
       write_registers(0x0146, {0, 0x28, 0, 0x29}),
       {0x01, 0x10, 0x01, 0x46, 0x00, 0x04, 0x08, 0x00, 0x00, 0x00, 0x28, 0x00, 0x00, 0x00, 0x29},
       {0x01, 0x10, 0x01, 0x46, 0x00, 0x04},
       {}},
      {"iEM-RS manual, peak current",
       1,
       write_register(0x0191, 0x0020),
       {0x01, 0x06, 0x01, 0x91, 0x00, 0x20},
       {0x01, 0x06, 0x01, 0x91, 0x00, 0x20},
       {}},
      {"Oriental Motor FAQ 0331",
       1,
       write_registers(0x1802, {0xFFFF, 0xFC18}),
       {0x01, 0x10, 0x18, 0x02, 0x00, 0x02, 0x04, 0xFF, 0xFF, 0xFC, 0x18},
       {0x01, 0x10, 0x18, 0x02, 0x00, 0x02},
       {}},
      {"Modbus V1.1b3, 6.3",
       0x11,
       read_holding_registers(0x006B, 3),
       {0x11, 0x03, 0x00, 0x6B, 0x00, 0x03},
       {0x11, 0x03, 0x06, 0x02, 0x2B, 0x00, 0x00, 0x00, 0x64},
       {0x022B, 0x0000, 0x0064}},
      {"Modbus V1.1b3, 6.4",
       1,
       read_input_registers(0x0008, 1),
       {0x01, 0x04, 0x00, 0x08, 0x00, 0x01},
       {0x01, 0x04, 0x02, 0x00, 0x0A},
       {0x000A}},
      {"Modbus V1.1b3, 6.1",
       1,
       read_coils(0x0013, 19),
       {0x01, 0x01, 0x00, 0x13, 0x00, 0x13},
       {0x01, 0x01, 0x03, 0xCD, 0x6B, 0x05},
       {1, 0, 1, 1, 0, 0, 1, 1, 1, 1, 0, 1, 0, 1, 1, 0, 1, 0, 1}},
      {"Modbus V1.1b3, 6.5",
       1,
       write_coil(0x00AC, true),
       {0x01, 0x05, 0x00, 0xAC, 0xFF, 0x00},
       {0x01, 0x05, 0x00, 0xAC, 0xFF, 0x00},
       {}}};
  return kGoldens;
}

TEST(ModbusRequest, EncodesPublishedFramesByteForByte) {
  for (const Golden& golden : goldens()) {
    EXPECT_EQ(encode(golden.unit, golden.request), golden.sent) << golden.source;
  }
}

TEST(ModbusRequest, DecodesPublishedAnswers) {
  for (const Golden& golden : goldens()) {
    const Answer answer = decode(golden.unit, golden.request, golden.answer);
    EXPECT_EQ(answer.kind, Kind::good) << golden.source << ": " << answer.what;
    EXPECT_EQ(answer.words, golden.words) << golden.source;
  }
}

TEST(ModbusRequest, DecodesPublishedExceptions) {
  // iEM-RS manual p. 20: a damaged request, a function it does not know.
  const Answer damaged = decode(1, read_holding_registers(1), Bytes{0x01, 0x83, 0x08});
  EXPECT_EQ(damaged.kind, Kind::exception);
  EXPECT_EQ(damaged.exception, 8);
  Request discrete_inputs = read_coils(1);
  discrete_inputs.function = static_cast<Function>(0x02);
  const Answer unknown = decode(1, discrete_inputs, Bytes{0x01, 0x82, 0x01});
  EXPECT_EQ(unknown.kind, Kind::exception);
  EXPECT_EQ(unknown.exception, 1);
}

TEST(ModbusRequest, AnswersToSomethingElseAreForeign) {
  const Request read = read_holding_registers(0x1014, 2);
  const Request write = write_register(0x6002, 0x0040);
  const Request block = write_registers(0x0058, {1, 2, 3});
  const std::tuple<const Request*, Bytes, const char*> kCases[] = {
      {&read, {2, 0x03, 4, 0, 0, 0, 0}, "unit 2"},
      {&read, {1, 0x04, 4, 0, 0, 0, 0}, "function 04"},
      {&read, {1, 0x03, 2, 0, 0}, "2 data bytes"},
      {&read, {1, 0x86, 2}, "function 06"},
      {&write, {1, 0x06, 0x60, 0x03, 0x00, 0x40}, "0x6003"},
      {&write, {1, 0x06, 0x60, 0x02, 0x00, 0x20}, "0x0020"},
      {&block, {1, 0x10, 0x00, 0x58, 0x00, 0x02}, "0x0002"},
      {&block, {1, 0x10, 0x00, 0x59, 0x00, 0x03}, "0x0059"}};
  for (const auto& [request, bytes, found] : kCases) {
    const Answer answer = decode(1, *request, bytes);
    EXPECT_EQ(answer.kind, Kind::foreign) << found;
    EXPECT_THAT(answer.what, HasSubstr(found));
  }
}

TEST(ModbusRequest, BytesThatAreNoAnswerAreMalformed) {
  const Request read = read_holding_registers(0, 2);
  const Request write = write_coil(0, true);
  EXPECT_EQ(decode(1, read, Bytes{}).kind, Kind::malformed);
  EXPECT_EQ(decode(1, read, Bytes{1, 3}).kind, Kind::malformed);
  EXPECT_EQ(decode(1, read, Bytes{1, 3, 4, 0, 0}).kind, Kind::malformed);
  EXPECT_EQ(decode(1, read, Bytes{1, 0x83, 2, 0}).kind, Kind::malformed);
  EXPECT_EQ(decode(1, write, Bytes{1, 5, 0, 0, 0xFF}).kind, Kind::malformed);
}

TEST(ModbusRequest, RefusesWhatNoFrameHolds) {
  EXPECT_THROW(read_holding_registers(0, 0), std::invalid_argument);
  EXPECT_THROW(read_holding_registers(0, 126), std::invalid_argument);
  EXPECT_THROW(read_input_registers(0xFFFF, 2), std::invalid_argument);
  EXPECT_THROW(read_coils(0, 2001), std::invalid_argument);
  EXPECT_THROW(write_registers(0, {}), std::invalid_argument);
  EXPECT_THROW(write_registers(0, std::vector<std::uint16_t>(124)), std::invalid_argument);
  EXPECT_EQ(write_registers(0, std::vector<std::uint16_t>(123)).count, 123);
  EXPECT_EQ(read_holding_registers(0xFFFF).address, 0xFFFF);
}

TEST(ModbusException, HasWordsAndAReaction) {
  using devices::DeviceErrc;
  const std::tuple<int, const char*, DeviceErrc, bool> kCases[] = {
      {0x01, "illegal function (01)", DeviceErrc::Fault, false},
      {0x02, "illegal address (02)", DeviceErrc::Fault, false},
      {0x03, "illegal value (03)", DeviceErrc::Fault, false},
      {0x04, "device failure (04)", DeviceErrc::Fault, false},
      {0x06, "busy (06)", DeviceErrc::Timeout, true},
      {0x08, "the unit received a damaged request (08)", DeviceErrc::Protocol, true},
      {0x0A, "gateway path unavailable (0A)", DeviceErrc::Disconnected, false},
      {0x0B, "no answer behind the gateway (0B)", DeviceErrc::Timeout, false},
      {0x63, "unknown exception (63)", DeviceErrc::Protocol, false}};
  for (const auto& [code, words, reaction, again] : kCases) {
    EXPECT_EQ(exception_text(code), words);
    EXPECT_EQ(errc_of_exception(code), reaction) << words;
    EXPECT_EQ(worth_repeating(code), again) << words;
  }
}

}  // namespace
}  // namespace gonio::modbus_bus
