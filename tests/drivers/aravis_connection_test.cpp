// Connections over a link made of paper, and what may be asked for.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <stop_token>
#include <string>
#include <vector>

#include "gonio/aravis_camera/aravis_camera.h"
#include "paper_camera.h"

namespace gonio::aravis_camera {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;
using namespace std::chrono_literals;

using AravisConnection = PaperTest;

TEST_F(AravisConnection, LostConnectionIsReportedAtOnceAndRepairedByTheNextCall) {
  camera();
  paper_.dead = true;
  expect_error(DeviceErrc::Disconnected, "gone", [&] { camera().capture(1ms); });
  EXPECT_EQ(paper_.triggers, 0);
  EXPECT_EQ(paper_.opened, 1);
  paper_.dead = false;
  camera().capture(1ms);
  EXPECT_EQ(paper_.opened, 2);
  EXPECT_EQ(camera().counters().reconnects, 1U);
}

TEST_F(AravisConnection, ReconnectingIsBounded) {
  camera();
  paper_.dead = true;
  EXPECT_THROW(camera().capture(1ms), DeviceError);
  paper_.absent = true;
  expect_error(DeviceErrc::Disconnected, "nobody answers", [&] { camera().capture(1ms); });
  paper_.absent = paper_.dead = false;
  camera().capture(1ms);
}

TEST_F(AravisConnection, StopEndsConnectingWithTheAttemptUnderWay) {
  AravisCameraOptions of = options();
  of.open_patience = std::chrono::hours(1);
  std::stop_source stop;
  int attempts = 0;
  const LinkOpener nobody = [&]() -> std::unique_ptr<CameraLink> {
    if (++attempts == 2) stop.request_stop();
    throw DeviceError(DeviceErrc::Disconnected, "camera", "nobody answers");
  };
  expect_error(DeviceErrc::Stopped, "asked to stop",
               [&] { AravisCamera(of, clock_, nobody, stop.get_token()); });
  EXPECT_EQ(attempts, 2);
}

TEST_F(AravisConnection, AnotherCameraAtTheSameAddressIsRefused) {
  camera();
  paper_.dead = true;
  EXPECT_THROW(camera().capture(1ms), DeviceError);
  paper_.dead = false;
  paper_.identity.serial = "43";
  expect_error(DeviceErrc::Protocol, "serial 43, expected 42", [&] { camera().capture(1ms); });
  paper_.identity.serial = "42";
  camera().capture(1ms);
}

TEST_F(AravisConnection, RefusesAnotherSerialThanTheOneAsked) {
  AravisCameraOptions of = options();
  of.serial = "7";
  expect_error(DeviceErrc::Protocol, "serial 42, expected 7", [&] { camera(of); });
}

TEST_F(AravisConnection, OpeningVerifiesTheSettings) {
  paper_.state.automatic = {"BalanceWhiteAuto"};
  expect_error(DeviceErrc::Protocol, "BalanceWhiteAuto", [&] { camera(); });
}

TEST_F(AravisConnection, OpensAgainWhileItsPatienceLasts) {
  int refusals = 3;
  AravisCameraOptions of = options();
  of.open_patience = 10s;
  const AravisCamera opened(of, clock_, [&]() -> std::unique_ptr<CameraLink> {
    if (refusals-- > 0) throw DeviceError(DeviceErrc::Disconnected, "camera", "owned");
    return std::make_unique<PaperLink>(paper_);
  });
  EXPECT_EQ(opened.identity().serial, "42");
}

TEST(AravisCameraOptions, RefusalsNameTheField) {
  const auto refusal = [](const std::function<void(AravisCameraOptions&)>& change) {
    AravisCameraOptions of;
    of.device = "10.0.0.2";
    change(of);
    try {
      of.validate();
    } catch (const std::invalid_argument& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal([](auto&) {}), "");
  EXPECT_EQ(refusal([](auto& of) { of.packet_size = 100; }),
            "camera camera: packet_size: found 100, expected 0 or 576 to 65535 bytes");
  for (const auto& [field, change] :
       std::vector<std::pair<std::string, std::function<void(AravisCameraOptions&)>>>{
           {"name", [](auto& of) { of.name.clear(); }},
           {"device", [](auto& of) { of.device.clear(); }},
           {"pixel_format", [](auto& of) { of.pixel_format = "RGB8"; }},
           {"region x", [](auto& of) { of.region.x = -1; }},
           {"region height", [](auto& of) { of.region.width = 10; }},
           {"gain_db", [](auto& of) { of.gain_db = std::nan(""); }},
           {"gain_raw_per_db", [](auto& of) { of.gain_raw_per_db = -1.0; }},
           {"black_level_dn", [](auto& of) { of.black_level_dn = -1.0; }},
           {"black_level_unit_dn", [](auto& of) { of.black_level_unit_dn = 0.0; }},
           {"readout", [](auto& of) { of.readout = -1ns; }},
           {"frame_margin", [](auto& of) { of.frame_margin = 0ms; }},
           {"retries", [](auto& of) { of.retries = -1; }},
           {"open_patience", [](auto& of) { of.open_patience = -1ms; }},
       }) {
    EXPECT_NE(refusal(change).find(field + ": found"), std::string::npos) << field;
  }
}

}  // namespace
}  // namespace gonio::aravis_camera
