#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/aravis_camera/wire_format.h"

namespace gonio::aravis_camera {

inline constexpr int kPaperWidth = 4;
inline constexpr int kPaperHeight = 2;

/// The camera behind the link: answers triggers with frames, as far as the script lets it. When a
/// frame arrives is written on it; nobody waits.
struct PaperCamera {
  CameraIdentity identity;
  CameraState state;
  std::uint64_t next_id = 1;
  std::deque<RawFrame> waiting;                       ///< frames that arrive, in order
  std::deque<std::function<void(RawFrame&)>> script;  ///< one step per trigger; empty: a good frame
  std::vector<std::byte> bytes = std::vector<std::byte>(kPaperWidth * kPaperHeight * 2);
  int triggers = 0;
  int restarts = 0;
  int opened = 0;
  /// After a restart it sends what it was exposing.
  bool finishes_after_restart = false;
  bool dead = false;    ///< every call is Disconnected
  bool absent = false;  ///< cannot be opened
  std::function<void()> on_restart;

  PaperCamera() {
    identity.vendor = "Paper";
    identity.model = "P1";
    identity.serial = "42";
    identity.region = {0, 0, kPaperWidth, kPaperHeight};
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

  static std::chrono::nanoseconds now() {
    return std::chrono::steady_clock::now().time_since_epoch();
  }

  /// Arrives now.
  RawFrame good_frame() {
    RawFrame frame;
    frame.arrived = now();
    frame.complete = true;
    frame.id = next_id++;
    frame.timestamp_ns = 0;
    frame.pixel_format = state.pixel_format;
    frame.width = kPaperWidth;
    frame.height = kPaperHeight;
    frame.bytes = bytes;
    return frame;
  }
};

class PaperLink final : public CameraLink {
 public:
  explicit PaperLink(PaperCamera& camera) : camera_(camera) {
    if (camera_.absent)
      throw devices::DeviceError(devices::DeviceErrc::Disconnected, "camera", "nobody answers");
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
    frame.arrived += std::chrono::nanoseconds(std::llround(camera_.state.exposure_us * 1000.0));
    if (!camera_.script.empty()) {
      const auto step = camera_.script.front();
      camera_.script.pop_front();
      if (!step) return;  // no frame
      step(frame);
    }
    camera_.waiting.push_back(frame);
  }
  bool take_frame(std::chrono::nanoseconds patience, const Take& take) override {
    live();
    if (camera_.waiting.empty()) return false;
    if (camera_.waiting.front().arrived > PaperCamera::now() + patience) return false;
    const RawFrame frame = camera_.waiting.front();
    camera_.waiting.pop_front();
    take(frame);
    return true;
  }
  void restart(bool free_running) override {
    live();
    ++camera_.restarts;
    if (!camera_.finishes_after_restart) camera_.waiting.clear();
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
    if (camera_.dead)
      throw devices::DeviceError(devices::DeviceErrc::Disconnected, "camera", "gone");
  }

  PaperCamera& camera_;
};

/// The state machine over it.
class PaperTest : public testing::Test {
 protected:
  AravisCameraOptions options() const {
    AravisCameraOptions of;
    of.device = "paper";
    of.retries = 2;
    of.open_patience = std::chrono::milliseconds(0);
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

  static void expect_error(devices::DeviceErrc code, const std::string& part,
                           const std::function<void()>& action) {
    try {
      action();
      FAIL() << "no error";
    } catch (const devices::DeviceError& error) {
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

}  // namespace gonio::aravis_camera
