#include <gtest/gtest.h>

#include "gonio/devices/camera.h"
#include "gonio/devices/clock.h"
#include "gonio/devices/device_error.h"
#include "gonio/devices/frame.h"
#include "gonio/devices/light_source.h"
#include "gonio/devices/rotation_stage.h"
#include "gonio/devices/target_changer.h"

namespace gonio::devices {
namespace {

TEST(DeviceError, SaysDeviceCodeAndReasonInOneLine) {
  const DeviceError error(DeviceErrc::LimitViolation, "tilt", "target 91 deg, limits -5 .. 70 deg");
  EXPECT_STREQ(error.what(), "tilt: limit violation: target 91 deg, limits -5 .. 70 deg");
  EXPECT_EQ(error.code(), DeviceErrc::LimitViolation);
  EXPECT_EQ(error.device(), "tilt");
}

TEST(DeviceError, EveryCodeHasAWordOfItsOwn) {
  EXPECT_EQ(to_string(DeviceErrc::Timeout), "timeout");
  EXPECT_EQ(to_string(DeviceErrc::Disconnected), "disconnected");
  EXPECT_EQ(to_string(DeviceErrc::Protocol), "protocol error");
  EXPECT_EQ(to_string(DeviceErrc::NotHomed), "not homed");
  EXPECT_EQ(to_string(DeviceErrc::Stopped), "stopped");
  EXPECT_EQ(to_string(DeviceErrc::Fault), "fault");
}

TEST(Frame, ReadsPixelsRowByRow) {
  Frame frame;
  frame.width_px = 3;
  frame.height_px = 2;
  frame.pixels_dn = {1, 2, 3, 4, 5, 6};
  EXPECT_EQ(frame.at(0, 2), 3);
  EXPECT_EQ(frame.at(1, 0), 4);
}

TEST(PixelFormat, NamesAreThoseOfTheFiles) {
  EXPECT_EQ(to_string(PixelFormat::mono), "mono");
  EXPECT_EQ(to_string(PixelFormat::bayer_rggb), "bayer_rggb");
  EXPECT_EQ(to_string(PixelFormat::bayer_grbg), "bayer_grbg");
  EXPECT_EQ(to_string(PixelFormat::bayer_gbrg), "bayer_gbrg");
  EXPECT_EQ(to_string(PixelFormat::bayer_bggr), "bayer_bggr");
}

TEST(Target, NamesAreThoseOfTheFiles) {
  EXPECT_EQ(to_string(Target::sample), "sample");
  EXPECT_EQ(to_string(Target::white), "white");
  EXPECT_EQ(to_string(Target::board), "board");
  EXPECT_EQ(to_string(Target::mirror), "mirror");
  EXPECT_EQ(to_string(Target::mirror_turned), "mirror_turned");
  EXPECT_EQ(to_string(Target::board_turned), "board_turned");
  EXPECT_EQ(to_string(Target::black_trap), "black_trap");
  EXPECT_EQ(to_string(Target::black_glass), "black_glass");
  EXPECT_EQ(to_string(Target::colour_chart), "colour_chart");
  EXPECT_EQ(in_words(Target::white), "white reference");
}

}  // namespace
}  // namespace gonio::devices
