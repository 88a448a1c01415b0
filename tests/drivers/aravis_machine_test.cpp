// The camera's state machine over a link made of paper: what no camera of good health sends.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/aravis_camera/wire_format.h"

namespace gonio::aravis_camera {
namespace {

using devices::DeviceErrc;
using devices::DeviceError;
using namespace std::chrono_literals;

constexpr int kWidth = 4;
constexpr int kHeight = 2;

/// The camera behind the link: answers triggers with frames, as far as the script lets it.
struct PaperCamera {
  CameraIdentity identity;
  CameraState state;
  std::uint64_t next_id = 1;
  std::deque<RawFrame> waiting;                       ///< frames that have arrived
  std::deque<std::function<void(RawFrame&)>> script;  ///< one step per trigger; empty: a good frame
  std::vector<std::byte> bytes = std::vector<std::byte>(kWidth * kHeight * 2);
  int triggers = 0;
  int restarts = 0;
  int opened = 0;
  bool dead = false;    ///< every call is Disconnected
  bool absent = false;  ///< cannot be opened
  std::function<void()> on_restart;

  PaperCamera() {
    identity.vendor = "Paper";
    identity.model = "P1";
    identity.serial = "42";
    identity.region = {0, 0, kWidth, kHeight};
    identity.min_exposure_us = 10.0;
    identity.max_exposure_us = 1e6;
    identity.exposure_feature = "ExposureTime";
    identity.gain_feature = "Gain";
    identity.black_level_feature = "BlackLevel";
    state.pixel_format = find_wire_format("Mono12")->code;
    state.region = identity.region;
    state.triggered = true;
    state.trigger_source = "Software";
  }

  RawFrame good_frame() {
    RawFrame frame;
    frame.complete = true;
    frame.id = next_id++;
    frame.timestamp_ns = 0;
    frame.pixel_format = state.pixel_format;
    frame.width = kWidth;
    frame.height = kHeight;
    frame.bytes = bytes;
    return frame;
  }
};

class PaperLink final : public CameraLink {
 public:
  explicit PaperLink(PaperCamera& camera) : camera_(camera) {
    if (camera_.absent) throw DeviceError(DeviceErrc::Disconnected, "camera", "nobody answers");
    ++camera_.opened;
  }

  const CameraIdentity& identity() const override { return camera_.identity; }
  CameraState state() override {
    live();
    return camera_.state;
  }
  void set_exposure_us(double exposure_us) override {
    live();
    camera_.state.exposure_us = exposure_us;
  }
  void trigger() override {
    live();
    ++camera_.triggers;
    RawFrame frame = camera_.good_frame();
    if (!camera_.script.empty()) {
      const auto step = camera_.script.front();
      camera_.script.pop_front();
      if (!step) return;  // no frame
      step(frame);
    }
    camera_.waiting.push_back(frame);
  }
  bool take_frame(std::chrono::nanoseconds /*patience*/, const Take& take) override {
    live();
    if (camera_.waiting.empty()) return false;
    const RawFrame frame = camera_.waiting.front();
    camera_.waiting.pop_front();
    take(frame);
    return true;
  }
  void restart(bool free_running) override {
    live();
    ++camera_.restarts;
    camera_.waiting.clear();
    camera_.state.triggered = !free_running;
    if (camera_.on_restart) camera_.on_restart();
  }
  std::optional<double> temperature_c() override {
    live();
    if (camera_.identity.temperature_feature.empty()) return std::nullopt;
    return 41.0;
  }

 private:
  void live() const {
    if (camera_.dead) throw DeviceError(DeviceErrc::Disconnected, "camera", "gone");
  }

  PaperCamera& camera_;
};

class AravisMachine : public testing::Test {
 protected:
  AravisCameraOptions options() const {
    AravisCameraOptions of;
    of.device = "paper";
    of.retries = 2;
    of.open_patience = 0ms;
    return of;
  }

  AravisCamera& camera() { return camera(options()); }
  AravisCamera& camera(const AravisCameraOptions& of) {
    if (!camera_) {
      camera_ = std::make_unique<AravisCamera>(
          of, clock_, [this] { return std::make_unique<PaperLink>(paper_); });
    }
    return *camera_;
  }

  static void expect_error(DeviceErrc code, const std::string& part,
                           const std::function<void()>& action) {
    try {
      action();
      FAIL() << "no error";
    } catch (const DeviceError& error) {
      EXPECT_EQ(error.code(), code) << error.what();
      EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
  }

  /// The same fault at every trigger of one capture().
  void always(const std::function<void(RawFrame&)>& step) { paper_.script = {step, step, step}; }

  devices::SteadyClock clock_;
  PaperCamera paper_;
  std::unique_ptr<AravisCamera> camera_;
};

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

TEST_F(AravisMachine, LostConnectionIsReportedAtOnceAndRepairedByTheNextCall) {
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

TEST_F(AravisMachine, ReconnectingIsBounded) {
  camera();
  paper_.dead = true;
  EXPECT_THROW(camera().capture(1ms), DeviceError);
  paper_.absent = true;
  expect_error(DeviceErrc::Disconnected, "nobody answers", [&] { camera().capture(1ms); });
  paper_.absent = paper_.dead = false;
  camera().capture(1ms);
}

TEST_F(AravisMachine, AnotherCameraAtTheSameAddressIsRefused) {
  camera();
  paper_.dead = true;
  EXPECT_THROW(camera().capture(1ms), DeviceError);
  paper_.dead = false;
  paper_.identity.serial = "43";
  expect_error(DeviceErrc::Protocol, "serial 43, expected 42", [&] { camera().capture(1ms); });
  paper_.identity.serial = "42";
  camera().capture(1ms);
}

TEST_F(AravisMachine, RefusesAnotherSerialThanTheOneAsked) {
  AravisCameraOptions of = options();
  of.serial = "7";
  expect_error(DeviceErrc::Protocol, "serial 42, expected 7", [&] { camera(of); });
}

TEST_F(AravisMachine, OpeningVerifiesTheSettings) {
  paper_.state.automatic = {"BalanceWhiteAuto"};
  expect_error(DeviceErrc::Protocol, "BalanceWhiteAuto", [&] { camera(); });
}

TEST_F(AravisMachine, OpensAgainWhileItsPatienceLasts) {
  int refusals = 3;
  AravisCameraOptions of = options();
  of.open_patience = 10s;
  const AravisCamera opened(of, clock_, [&]() -> std::unique_ptr<CameraLink> {
    if (refusals-- > 0) throw DeviceError(DeviceErrc::Disconnected, "camera", "owned");
    return std::make_unique<PaperLink>(paper_);
  });
  EXPECT_EQ(opened.identity().serial, "42");
}

TEST_F(AravisMachine, HardwareTriggerWaitsForAFrameThatOthersTrigger) {
  AravisCameraOptions of = options();
  of.trigger_line = "Line1";
  paper_.state.trigger_source = "Line1";
  camera(of);
  expect_error(DeviceErrc::Timeout, "is Line1 pulsed?", [&] { camera().capture(1ms); });
  EXPECT_EQ(paper_.triggers, 0);
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
