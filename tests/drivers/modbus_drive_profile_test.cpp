#include "gonio/modbus_stage/drive_profile.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <stdexcept>

#include "drive_codec.h"
#include "some_drive.h"

namespace gonio::modbus_stage {
namespace {

using modbus_bus::Function;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(DriveProfile, WholeOneIsValid) { EXPECT_NO_THROW(some_drive().validate()); }

TEST(DriveProfile, RefusalNamesTheField) {
  const std::pair<std::function<void(DriveProfile&)>, const char*> kCases[] = {
      {[](auto& p) { p.name.clear(); }, "name: found none"},
      {[](auto& p) { p.registers[1].name = p.registers[0].name; }, "different names"},
      {[](auto& p) { p.registers[0].words = 0; }, "words: found 0"},
      {[](auto& p) { p.registers[0].address = 0xFFFF, p.registers[0].words = 2; }, "16 bits"},
      {[](auto& p) { p.registers[0].scale = 0.0; }, "scale: found 0"},
      {[](auto& p) { p.steps_per_rev = 0; }, "units.steps_per_rev"},
      {[](auto& p) { p.speed_scale = -1.0; }, "units.speed_scale"},
      {[](auto& p) { p.acceleration_scale = 0.0; }, "units.acceleration_scale"},
      {[](auto& p) { p.status_register = "nothing"; }, "status.register: found \"nothing\""},
      {[](auto& p) { p.position_register.clear(); }, "position.register: found none"},
      {[](auto& p) { p.position_register = "pr0"; }, "1 or 2 words"},
      {[](auto& p) { p.max_following_error = 0.0; }, "following_error.max"},
      {[](auto& p) { p.fault.bit = 16; }, "status.fault: found 16, expected 0 to 15"},
      {[](auto& p) { p.limit_register.clear(); }, "limits.forward"},
      {[](auto& p) { p.moving = {}; }, "status.moving: found none"},
      {[](auto& p) { p.command_complete = {}, p.in_position = {}; }, "status.in_position"},
      {[](auto& p) { p.move.clear(); }, "move: found nothing"},
      {[](auto& p) { p.home.clear(); }, "home: found nothing"},
      {[](auto& p) { p.stop.clear(); }, "stop: found nothing"},
      {[](auto& p) { p.stop[0].register_name = "brake"; }, "stop[0]: register: found \"brake\""},
      {[](auto& p) {
         p.stop[0].words = {"0", "0"};
       },
       "stop[0]: words: found 2 of them"},
      {[](auto& p) { p.stop[0].words = {"target"}; }, "stop[0]: words: found \"target\""},
      {[](auto& p) { p.stop[0].words = {"65536"}; }, "found \"65536\""},
      {[](auto& p) { p.move[0].words = {"speed"}; }, "move: found no target"},
      {[](auto& p) { p.move[0].words[0] = "target.middle"; }, "found \"target.middle\""},
      {[](auto& p) { p.registers[6].space = Register::Space::input; }, "an input register"},
      {[](auto& p) { p.expected[0].register_name = "x"; }, "expected.register"},
      {[](auto& p) { p.start_time = std::chrono::seconds(11); }, "start_time_ms: found 11000"}};
  for (const auto& [spoil, expected] : kCases) {
    DriveProfile profile = some_drive();
    spoil(profile);
    EXPECT_THAT([&] { profile.validate(); },
                testing::ThrowsMessage<std::invalid_argument>(HasSubstr(expected)))
        << expected;
  }
}

TEST(DriveCodec, ReadsWordsOfAProfile) {
  const auto is = [](const char* text, Word::Source source, Word::Part part, int constant) {
    const auto word = word_from_text(text);
    return word && word->source == source && word->part == part && word->constant == constant;
  };
  using Source = Word::Source;
  using Part = Word::Part;
  EXPECT_TRUE(is("0", Source::constant, Part::whole, 0));
  EXPECT_TRUE(is("65535", Source::constant, Part::whole, 65535));
  EXPECT_TRUE(is("0x00fF", Source::constant, Part::whole, 255));
  EXPECT_TRUE(is("-4", Source::constant, Part::whole, 0xFFFC));
  EXPECT_TRUE(is("-32768", Source::constant, Part::whole, 0x8000));
  EXPECT_TRUE(is("target.high", Source::target, Part::high, 0));
  EXPECT_TRUE(is("speed.low", Source::speed, Part::low, 0));
  EXPECT_TRUE(is("deceleration", Source::deceleration, Part::whole, 0));
  for (const char* const text : {"", "-", "0x", "65536", "-32769", "1.5", "target.", "aim", " 1"}) {
    EXPECT_FALSE(word_from_text(text)) << text;
  }
}

TEST(DriveCodec, ReadsNumbersInEveryWordOrder) {
  const std::vector<std::uint16_t> words{0xFFFF, 0xFC18};
  Register two{.name = "position", .words = 2, .is_signed = true};
  EXPECT_EQ(number_from_words(two, words), -1000);
  two.is_signed = false;
  EXPECT_EQ(number_from_words(two, words), 4294966296);
  two.low_word_first = true;
  EXPECT_EQ(number_from_words(two, words), 0xFC18FFFF);
  Register one{.name = "torque", .is_signed = true};
  EXPECT_EQ(number_from_words(one, std::vector<std::uint16_t>{0xFF9C}), -100);
  one.is_signed = false;
  EXPECT_EQ(number_from_words(one, std::vector<std::uint16_t>{0xFF9C}), 65436);
}

TEST(DriveCodec, WritesOneWordByFunctionSixUnlessToldOtherwise) {
  Register to{.name = "command", .address = 0x0210};
  EXPECT_EQ(write_request(to, {"command", {"4"}}, {}).function, Function::write_register);
  to.write_multiple = true;
  EXPECT_EQ(write_request(to, {"command", {"4"}}, {}).function, Function::write_registers);
}

TEST(DriveCodec, PutsTheNumbersOfAMoveWhereTheProfileWantsThem) {
  const Register to{.name = "move", .words = 8};
  const RegisterWrite write{"move",
                            {"1", "target.high", "target.low", "speed", "acceleration",
                             "deceleration.high", "deceleration.low", "-1"}};
  EXPECT_THAT(write_request(to, write, {-1000, 300, 40, 0x12345}).words,
              ElementsAre(1, 0xFFFF, 0xFC18, 300, 40, 0x0001, 0x2345, 0xFFFF));
  EXPECT_THAT(
      [&] {
        write_request(to, write, {0, 65536, 40, 40});
      },
      testing::ThrowsMessage<std::invalid_argument>(HasSubstr("speed: found 65536")));
}

TEST(DriveCodec, ConvertsPacesAndNeverExceedsThem) {
  DriveProfile profile = some_drive();  // 10000 steps per revolution
  profile.speed_unit = DriveProfile::SpeedUnit::rpm;
  profile.acceleration_unit = DriveProfile::AccelerationUnit::ms_per_1000rpm;
  EXPECT_EQ(speed_number(profile, 100.0, 20.0), 12);            // 2000 steps/s, 0.2 rev/s
  EXPECT_EQ(speed_number(profile, 100.0, 21.0), 12);            // 12.6 rpm
  EXPECT_EQ(acceleration_number(profile, 100.0, 30.0), 55556);  // 18 rpm/s: 55.5556 s to 1000 rpm
  profile.speed_scale = 0.1;
  EXPECT_EQ(speed_number(profile, 100.0, 21.0), 126);
  profile.speed_unit = DriveProfile::SpeedUnit::steps_per_s;
  profile.acceleration_unit = DriveProfile::AccelerationUnit::steps_per_s2;
  profile.speed_scale = 1.0;
  EXPECT_EQ(speed_number(profile, 100.0, 20.0), 2000);
  EXPECT_EQ(acceleration_number(profile, 100.0, 30.0), 3000);
  EXPECT_THROW(speed_number(profile, 100.0, 0.001), std::invalid_argument);
  EXPECT_THROW(acceleration_number(profile, 1e9, 1e6), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::modbus_stage
