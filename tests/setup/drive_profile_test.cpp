// Drive profiles as files.

#include "gonio/setup/drive_profile_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "gonio/errors/errors.h"
#include "gonio/files/text_file.h"

namespace gonio::cli {
namespace {

using modbus_stage::DriveProfile;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

std::string profile_text(const std::string& name) {
  return files::read_text_file(std::string(GONIO_RIGS) + "/drives/" + name + ".toml", 1 << 20);
}

/// The generic profile with one change is refused, and the message holds the line and `why`.
void expect_profile_refused(const std::string& from, const std::string& to,
                            const std::string& why) {
  std::string text = profile_text("generic");
  const std::size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  const auto line =
      1 + std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(at), '\n');
  text.replace(at, from.size(), to);
  EXPECT_THAT([&] { drive_profile_from_text(text, "drive.toml"); },
              ThrowsMessage<ConfigError>(
                  AllOf(HasSubstr("drive.toml:" + std::to_string(line) + " "), HasSubstr(why))));
}

TEST(DriveProfileFile, AllThatAreShippedAreValidAndAreTheFilesOfTheTree) {
  EXPECT_THAT(shipped_drive_names(), ElementsAre("leadshine-em2rs", "oriental-az", "generic"));
  for (const std::string& name : shipped_drive_names()) {
    EXPECT_EQ(shipped_drive_profile(name).name, name);
    EXPECT_EQ(read_drive_profile(std::string(GONIO_RIGS) + "/drives/" + name + ".toml").name, name);
  }
}

TEST(DriveProfileFile, SaysWhatTheManualSays) {
  const DriveProfile leadshine = shipped_drive_profile("leadshine-em2rs");
  EXPECT_EQ(leadshine.find("feedback_position")->address, 0x1014);
  EXPECT_TRUE(leadshine.find("feedback_position")->is_signed);
  EXPECT_EQ(leadshine.homed.bit, 6);
  EXPECT_FALSE(leadshine.find("home")->confirmed);
  EXPECT_FALSE(leadshine.find("stop")->confirmed);
  EXPECT_EQ(leadshine.stop.at(0).register_name, "stop");
  EXPECT_FALSE(leadshine.home.at(0).repeatable);
  EXPECT_EQ(leadshine.speed_unit, DriveProfile::SpeedUnit::rpm);
  EXPECT_EQ(leadshine.expected.at(0).value, 10000);
  const DriveProfile az = shipped_drive_profile("oriental-az");
  EXPECT_EQ(az.move.at(0).words.size(), 16U);
  EXPECT_EQ(az.alarm_texts.at(1).code, 0x66);
  EXPECT_FALSE(az.find("present_alarm")->confirmed);
  EXPECT_TRUE(az.absolute_encoder);
}

TEST(DriveProfileFile, InvertedBitsAreNamed) {
  std::string text = profile_text("generic");
  const std::string none = "inverted = []";
  text.replace(text.find(none), none.size(), "inverted = [\"fault\", \"homed\"]");
  const DriveProfile profile = drive_profile_from_text(text, "drive.toml");
  EXPECT_TRUE(profile.fault.inverted);
  EXPECT_TRUE(profile.homed.inverted);
  EXPECT_FALSE(profile.moving.inverted);
}

TEST(DriveProfileFile, ErrorsNameFileLineAndKey) {
  expect_profile_refused("start_time_ms", "start_time", "start_time: unknown key");
  expect_profile_refused("address = 0x0102", "adress = 0x0102", "did you mean \"address\"?");
  expect_profile_refused("address = 0x0102", "address = 0x10102", "expected 0 to 65535");
  expect_profile_refused("space = \"holding\"", "space = \"coil\"", "\"holding\" or \"input\"");
  expect_profile_refused("speed = \"steps_per_s\"", "speed = 5", "units.speed");
  expect_profile_refused("inverted = []", "inverted = [\"faults\"]", "found \"faults\"");
  expect_profile_refused("words = [\"0x0004\"]", "words = [4]", "expected text");
}

TEST(DriveProfileFile, WhatDoesNotFitTogetherIsNamed) {
  std::string text = profile_text("generic");
  const std::string moving = "moving = 2";
  text.replace(text.find(moving), moving.size(), "moving = -1");
  EXPECT_THAT([&] { drive_profile_from_text(text, "drive.toml"); },
              ThrowsMessage<ConfigError>(
                  AllOf(HasSubstr("drive.toml"), HasSubstr("status.moving: found none"))));
}

TEST(DriveProfileFile, UnknownNameSaysWhichThereAre) {
  EXPECT_THAT([] { shipped_drive_profile("leadshine-em2r"); },
              ThrowsMessage<std::invalid_argument>(
                  AllOf(HasSubstr("oriental-az"), HasSubstr("did you mean \"leadshine-em2rs\"?"))));
}

}  // namespace
}  // namespace gonio::cli
