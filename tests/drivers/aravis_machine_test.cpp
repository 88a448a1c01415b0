// The camera's state machine over a link made of paper: what no camera of good health sends.

#include <gtest/gtest.h>

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/aravis_camera/wire_format.h"
#include "paper_camera.h"

namespace gonio::aravis_camera {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;
using namespace std::chrono_literals;

using AravisMachine = PaperTest;

TEST_F(AravisMachine, UnpacksAndSaysWhatTheCameraApplied) {
  paper_.bytes[2] = std::byte{0x34};
  paper_.bytes[3] = std::byte{0x02};
  paper_.state.black_level = 64.0;
  AravisCameraOptions of = options();
  of.black_level_dn = 64.0;
  const devices::Frame frame = camera(of).capture(5ms);
  EXPECT_EQ(frame.at(0, 1), 0x234);
  EXPECT_EQ(frame.exposure, 5ms);
  EXPECT_EQ(frame.black_level_dn, 64.0);
  EXPECT_EQ(frame.saturation_level_dn, 4095);
  EXPECT_EQ(camera().counters().frames, 1U);
}

TEST_F(AravisMachine, FrameNumbersAreTheDriversOwn) {
  paper_.next_id = 65534;
  for (std::uint64_t number = 0; number < 4; ++number) {
    if (paper_.next_id == 65536) paper_.next_id = 1;
    EXPECT_EQ(camera().capture(1ms).frame_id, number);
  }
  EXPECT_EQ(camera().counters().id_gaps, 0U);
}

TEST_F(AravisMachine, RepeatsAnExposureWithoutFrame) {
  camera();
  paper_.script = {nullptr, [](RawFrame&) {}};
  camera().capture(1ms);
  EXPECT_EQ(paper_.triggers, 2);
  EXPECT_EQ(paper_.restarts, 1);  // what the first trigger may still bring must not be the answer
  EXPECT_EQ(camera().counters().timeouts, 1U);
  EXPECT_EQ(camera().counters().retried, 1U);
}

TEST_F(AravisMachine, GivesUpAfterItsRetries) {
  always(nullptr);
  expect_error(DeviceErrc::Timeout, "no frame", [&] { camera().capture(1ms); });
  EXPECT_EQ(paper_.triggers, 3);
  EXPECT_EQ(camera().counters().frames, 0U);
}

TEST_F(AravisMachine, StartsAnewBeforeTheNextExposureAfterAFailure) {
  always(nullptr);
  EXPECT_THROW(camera().capture(1ms), DeviceError);
  const int before = paper_.restarts;
  camera().capture(1ms);
  EXPECT_EQ(paper_.restarts, before + 1);
}

TEST_F(AravisMachine, IncompleteFrameIsProtocol) {
  always([](RawFrame& frame) {
    frame.complete = false;
    frame.problem = "packets are missing";
  });
  expect_error(DeviceErrc::Protocol, "packets are missing", [&] { camera().capture(1ms); });
  EXPECT_EQ(camera().counters().incomplete, 3U);
}

TEST_F(AravisMachine, DuplicateFrameIdIsProtocol) {
  camera().capture(1ms);
  AravisCameraOptions of = options();
  paper_.script = {[](RawFrame& frame) { frame.id = 1; }};
  camera().capture(1ms);  // the repetition is good
  EXPECT_EQ(camera().counters().out_of_order, 1U);
  EXPECT_EQ(camera().counters().retried, 1U);
}

TEST_F(AravisMachine, FrameOfWrongSizeIsNeverReturned) {
  always([](RawFrame& frame) { frame.bytes = frame.bytes.first(frame.bytes.size() - 2); });
  expect_error(DeviceErrc::Protocol, "14 bytes, expected 16", [&] { camera().capture(1ms); });
}

TEST_F(AravisMachine, FrameOfAnotherWindowIsProtocol) {
  always([](RawFrame& frame) { frame.width = 2; });
  expect_error(DeviceErrc::Protocol, "2 x 2 px", [&] { camera().capture(1ms); });
}

TEST_F(AravisMachine, FrameOfAnotherFormatIsProtocol) {
  always([](RawFrame& frame) { frame.pixel_format = find_wire_format("Mono16")->code; });
  expect_error(DeviceErrc::Protocol, "Mono16, asked Mono12", [&] { camera().capture(1ms); });
}

TEST_F(AravisMachine, WrongExposureIsProtocol) {
  always([this](RawFrame&) { paper_.state.exposure_us *= 1.5; });
  expect_error(DeviceErrc::Protocol, "exposure is 1500 us, asked 1000 us",
               [&] { camera().capture(1ms); });
  EXPECT_EQ(camera().counters().wrong_settings, 3U);
}

TEST_F(AravisMachine, FrameCarriesTheRoundedExposure) {
  paper_.script = {[this](RawFrame&) { paper_.state.exposure_us = 10003.0; }};
  EXPECT_EQ(camera().capture(10ms).exposure, 10003us);
}

TEST_F(AravisMachine, AutomaticFeatureThatSwitchesItselfOnIsProtocol) {
  camera();
  paper_.state.automatic = {"GainAuto"};
  expect_error(DeviceErrc::Protocol, "GainAuto is on", [&] { camera().capture(1ms); });
}

TEST_F(AravisMachine, SettingsThatArePutRightByARestartGiveAGoodFrame) {
  camera();
  paper_.state.automatic = {"ExposureAuto"};
  paper_.on_restart = [this] { paper_.state.automatic.clear(); };
  camera().capture(1ms);
  EXPECT_EQ(camera().counters().wrong_settings, 1U);
  EXPECT_EQ(camera().counters().frames, 1U);
}

TEST_F(AravisMachine, ChangedGainBlackLevelRegionAndTriggerAreProtocol) {
  camera();
  const CameraState right = paper_.state;
  const auto expect_refused = [&](const std::string& part) {
    expect_error(DeviceErrc::Protocol, part, [&] { camera().capture(1ms); });
    paper_.state = right;
  };
  paper_.state.gain = 6.0;
  expect_refused("gain is 6 dB");
  paper_.state.black_level = 20.0;
  expect_refused("BlackLevel is 20");
  paper_.state.region.x = 2;
  expect_refused("region is 4 x 2 px at 2, 0");
  paper_.state.trigger_source = "Line1";
  expect_refused("trigger source is Line1");
  paper_.state.pixel_format = find_wire_format("Mono8")->code;
  expect_refused("Mono8, asked Mono12");
}

TEST_F(AravisMachine, FramesThatLieReadyAreNeverTheAnswer) {
  camera();
  paper_.bytes[0] = std::byte{1};
  RawFrame old = paper_.good_frame();
  const std::vector<std::byte> other(paper_.bytes.size(), std::byte{0x0F});
  old.bytes = other;
  paper_.waiting.push_back(old);
  EXPECT_EQ(camera().capture(1ms).at(0, 0), 1);
  EXPECT_EQ(camera().counters().unexpected, 1U);
}

TEST_F(AravisMachine, MissingFramesBetweenAreCounted) {
  camera().capture(1ms);
  paper_.next_id += 4;
  camera().capture(1ms);
  EXPECT_EQ(camera().counters().id_gaps, 4U);
}

TEST_F(AravisMachine, TemperatureIsReadOrSaidToBeMissing) {
  expect_error(DeviceErrc::Fault, "no DeviceTemperature", [&] { camera().temperature_c(); });
  paper_.identity.temperature_feature = "DeviceTemperature";
  EXPECT_EQ(camera().temperature_c(), 41.0);
}

TEST_F(AravisMachine, GainRawIsConvertedByTheFactorOfTheManual) {
  paper_.identity.gain_feature = "GainRaw";
  paper_.state.gain = 120.0;
  AravisCameraOptions of = options();
  of.gain_db = 12.0;
  of.gain_raw_per_db = 10.0;
  EXPECT_EQ(camera(of).capture(1ms).gain_db, 12.0);
}

TEST_F(AravisMachine, StreamHandsOnFramesUntilTold) {
  camera();
  paper_.on_restart = [this] {
    if (paper_.state.triggered) return;
    for (int index = 0; index < 5; ++index) paper_.waiting.push_back(paper_.good_frame());
    paper_.waiting[2].complete = false;
  };
  int seen = 0;
  camera().stream(1ms, [&](const devices::Frame&) { return ++seen < 4; });
  EXPECT_EQ(seen, 4);
  EXPECT_EQ(camera().counters().incomplete, 1U);
  camera().capture(1ms);  // back to triggers
  EXPECT_TRUE(paper_.state.triggered);
}

// Left-aligned, as the 12 bits of some cameras are in 16: sixteen times too much.
TEST_F(AravisMachine, LeftAlignedPixelsAreProtocol) {
  paper_.bytes[0] = std::byte{0x40};
  paper_.bytes[1] = std::byte{0x12};
  expect_error(DeviceErrc::Protocol, "left-aligned or big-endian pixels?",
               [&] { camera().capture(1ms); });
  EXPECT_EQ(camera().counters().frames, 0U);
}

TEST_F(AravisMachine, BigEndianPixelsAreProtocol) {
  paper_.bytes[14] = std::byte{0x01};  // 300 DN in the last pixel
  paper_.bytes[15] = std::byte{0x2C};
  expect_error(DeviceErrc::Protocol, "above the 12 bits of Mono12", [&] { camera().capture(1ms); });
}

TEST_F(AravisMachine, LargestNumberOfTheFormatIsGood) {
  paper_.bytes[2] = std::byte{0xFF};
  paper_.bytes[3] = std::byte{0x0F};
  EXPECT_EQ(camera().capture(1ms).at(0, 1), 4095);
}

TEST(CameraCounters, AreOneLineOfWhatHappened) {
  CameraCounters counters;
  EXPECT_EQ(to_text(counters), "frames 0");
  counters.frames = 120;
  counters.retried = 2;
  counters.incomplete = 1;
  counters.reconnects = 1;
  EXPECT_EQ(to_text(counters), "frames 120, retried 2, incomplete 1, reconnects 1");
}

}  // namespace
}  // namespace gonio::aravis_camera
