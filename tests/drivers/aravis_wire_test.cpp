// The driver and an emulated camera over loopback: pixels, settings, identity.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "private_loopback.h"
#include "wire_camera.h"
#include "wire_expectations.h"

namespace gonio::aravis_camera {
namespace {

using devices::DeviceErrc;
using gige_emulator::Feature;
using namespace std::chrono_literals;

const auto* const kLoopback = testing::AddGlobalTestEnvironment(new PrivateLoopback({"127.0.0.2"}));

class AravisFormats : public testing::TestWithParam<WireFormat> {};

TEST_P(AravisFormats, EveryPixelArrivesAsTheSensorGaveIt) {
  WireCamera wire(std::string(GetParam().name), {}, 20.0, 66, 38);
  AravisCamera camera = wire.open();
  const devices::Frame frame = camera.capture(1ms);
  EXPECT_EQ(frame.pixel_format, GetParam().layout);
  EXPECT_EQ(frame.width_px, 66);
  EXPECT_EQ(frame.height_px, 38);
  EXPECT_TRUE(shows_pattern(frame, GetParam().bits, {0, 0, 66, 38}));
}

std::string format_name(const testing::TestParamInfo<WireFormat>& info) {
  return std::string(info.param.name);
}

INSTANTIATE_TEST_SUITE_P(Wire, AravisFormats,
                         testing::ValuesIn(wire_formats().begin(), wire_formats().end()),
                         format_name);

TEST(AravisWire, ShowsTheRegionOfInterest) {
  WireCamera wire("Mono12p");
  wire.options().region = {40, 20, 128, 64};
  AravisCamera camera = wire.open();
  EXPECT_EQ(camera.info().width_px, 128);
  EXPECT_EQ(camera.info().height_px, 64);
  EXPECT_TRUE(shows_pattern(camera.capture(1ms), 12, {40, 20, 128, 64}));
}

TEST(AravisWire, GainAndBlackLevelActOnThePixelsAndAreInTheFrame) {
  WireCamera wire("Mono12");
  wire.options().gain_db = 6.0;
  wire.options().black_level_dn = 100.0;
  const devices::Frame frame = wire.open().capture(1ms);
  EXPECT_EQ(frame.gain_db, 6.0);
  EXPECT_EQ(frame.black_level_dn, 100.0);
  // 6 dB are a factor of 1.9953.
  const int row = 0;
  const int column = 10;
  EXPECT_NEAR(frame.at(row, column), 100.0 + 1.9953 * (PatternCamera::value(row, column) - 64.0),
              1.0);
}

TEST(AravisWire, SettingsOutsideTheCamerasRangeAreRefused) {
  WireCamera wire;
  wire.options().gain_db = 40.0;
  expect_error(DeviceErrc::LimitViolation, "Gain", kControlDeadline, [&] { wire.open(); });
  wire.options().gain_db = 0.0;
  wire.options().region = {0, 0, 640, 480};
  expect_error(DeviceErrc::LimitViolation, "", kControlDeadline, [&] { wire.open(); });
  wire.options().region = {};
  wire.options().trigger_line = "Line7";
  expect_error(DeviceErrc::Fault, "Line7", kControlDeadline, [&] { wire.open(); });
}

TEST(AravisWire, IsFoundAndSaysWhoItIs) {
  WireCamera wire;
  const std::vector<CameraDeviceInfo> found = list_cameras();
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].vendor, "Gonio");
  EXPECT_EQ(found[0].model, "pattern");
  EXPECT_EQ(found[0].serial, "P-0001");
  EXPECT_EQ(found[0].address, "127.0.0.1");
  EXPECT_EQ(found[0].protocol, "GigEVision");
  wire.options().device = found[0].id;
  wire.options().serial = "P-0001";
  AravisCamera camera = wire.open();
  EXPECT_EQ(camera.info().model, "pattern");
  EXPECT_EQ(camera.info().serial, "P-0001");
  EXPECT_EQ(camera.identity().exposure_feature, "ExposureTime");
  EXPECT_EQ(camera.identity().gain_feature, "Gain");
  camera.capture(1ms);
}

TEST(AravisWire, CameraWithoutTestPacketsStaysAtItsPacketSize) {
  WireCamera wire;
  wire.options().packet_size = 0;
  const auto start = std::chrono::steady_clock::now();
  AravisCamera camera = wire.open();
  EXPECT_LE(std::chrono::steady_clock::now() - start, kSlack);
  EXPECT_EQ(camera.identity().packet_size, 9000);
  EXPECT_TRUE(shows_pattern(camera.capture(1ms), 12, {0, 0, 320, 256}));
}

TEST(AravisWire, TemperatureIsTheSensors) {
  WireCamera wire;
  AravisCamera camera = wire.open();
  wire.emulator().set(Feature::temperature_c, 44.25);
  EXPECT_EQ(camera.temperature_c(), 44.25);
}

TEST(AravisWire, TwoCamerasAnswerAtTwoAddresses) {
  WireCamera wire;
  PatternCamera other_pattern(wire.clock(), devices::PixelFormat::mono, 64, 32);
  gige_emulator::GigeCameraOptions other_options;
  other_options.address = "127.0.0.2";
  other_options.serial = "P-0002";
  const gige_emulator::GigeCamera other(other_options, other_pattern, wire.clock(), wire.faults());
  AravisCamera first = wire.open();
  wire.options().device = "127.0.0.2";
  AravisCamera second = wire.open();
  EXPECT_EQ(first.info().serial, "P-0001");
  EXPECT_EQ(second.info().serial, "P-0002");
  EXPECT_EQ(first.capture(1ms).width_px, 320);
  EXPECT_EQ(second.capture(1ms).width_px, 64);
}

TEST(AravisWire, EmulatedCameraRefusesAnAddressItCannotHave) {
  WireCamera wire;
  PatternCamera pattern(wire.clock(), devices::PixelFormat::mono, 64, 32);
  gige_emulator::GigeCameraOptions options;
  EXPECT_THROW(gige_emulator::GigeCamera(options, pattern, wire.clock(), wire.faults()),
               std::runtime_error);  // one is there
  options.address = "192.0.2.1";     // documentation only, RFC 5737
  EXPECT_THROW(gige_emulator::GigeCamera(options, pattern, wire.clock(), wire.faults()),
               std::runtime_error);
  options.address = "camera.local";
  EXPECT_THROW(gige_emulator::GigeCamera(options, pattern, wire.clock(), wire.faults()),
               std::invalid_argument);
  options.address = "127.0.0.2";
  options.serial = std::string(16, '7');
  EXPECT_THROW(gige_emulator::GigeCamera(options, pattern, wire.clock(), wire.faults()),
               std::invalid_argument);
}

TEST(AravisWire, NobodyAtTheAddressIsDisconnected) {
  WireCamera wire;
  wire.options().device = "127.0.0.2";
  wire.options().open_patience = 0ms;
  expect_error(DeviceErrc::Disconnected, "no camera answers at 127.0.0.2", 2 * kControlDeadline,
               [&] { wire.open(); });
}

TEST(AravisWire, ControlChannelLivesDuringALongExposureAtRealPace) {
  WireCamera wire("Mono12", {}, 1.0);  // longer than the heartbeat's 3 s
  AravisCamera camera = wire.open();
  const auto start = std::chrono::steady_clock::now();
  EXPECT_EQ(camera.capture(4s).exposure, 4s);
  EXPECT_GE(std::chrono::steady_clock::now() - start, 4s);
  camera.capture(1ms);
  EXPECT_EQ(camera.counters().retried, 0U);
  EXPECT_EQ(camera.counters().reconnects, 0U);
}

}  // namespace
}  // namespace gonio::aravis_camera
