#pragma once

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "directions_deg.h"
#include "example_instrument.h"
#include "gonio/acquisition/session.h"

namespace gonio::acquisition {

/// Devices with no physics: what a test says happens, happens, and everything is written down.

class FakeClock final : public devices::Clock {
 public:
  Duration now() const override { return now_; }
  void wait_until(Duration time) override { now_ = std::max(now_, time); }
  void pass(Duration time) { now_ += time; }

 private:
  Duration now_{0};
};

class FakeStage final : public devices::RotationStage {
 public:
  explicit FakeStage(const rig::Axis& axis) : name_(axis.name), limits_{axis.min, axis.max} {}
  const std::string& name() const override { return name_; }
  devices::JointLimits limits() const override { return limits_; }
  void home(std::chrono::milliseconds) override {
    refuse_when_stopped();
    ++homing_attempts;
    if (on_home) on_home(*this);
    ++homings;
    at_ = home_angle;
  }
  void begin_move_to(Angle target) override {
    refuse_when_stopped();
    refuse_when_not_homed();
    if (on_move) on_move(*this);
    ++moves;
    at_ = target;
    if (moved) moved(*this, target);
  }
  Angle wait_until_settled(std::chrono::milliseconds) override {
    refuse_when_stopped();
    refuse_when_not_homed();
    if (failing_readings > 0) {
      --failing_readings;
      throw devices::DeviceError(devices::DeviceErrc::Protocol, name_, "checksum");
    }
    if (on_settle) on_settle();
    return at_ + reading_error;
  }
  void stop() noexcept override {
    stopped = true;
    ++stops;
  }
  void rearm() override { stopped = false; }
  /// Turns the axis though nobody asked.
  void creep(Angle by) { at_ += by; }

  int homing_attempts = 0;
  std::function<void(FakeStage&)> on_home;
  std::function<void(FakeStage&)> on_move;
  std::function<void(const FakeStage&, Angle)> moved;
  std::function<void()> on_settle;
  Angle home_angle;
  int failing_readings = 0;
  Angle reading_error;  ///< of the encoder, or of where the stage comes to stand
  int homings = 0;
  int moves = 0;
  int stops = 0;
  bool stopped = false;

 private:
  void refuse_when_not_homed() const {
    if (homings == 0) throw devices::DeviceError(devices::DeviceErrc::NotHomed, name_, "not homed");
  }
  void refuse_when_stopped() const {
    if (stopped) throw devices::DeviceError(devices::DeviceErrc::Stopped, name_, "stop is latched");
  }

  std::string name_;
  devices::JointLimits limits_;
  Angle at_;
};

class FakeLight final : public devices::LightSource {
 public:
  const std::string& name() const override { return name_; }
  std::vector<devices::LightChannel> channels() const override {
    return {{"R", 630.0}, {"G", 530.0}, {"B", 465.0}};
  }
  void light(const std::string& channel) override { lit = channel; }
  void close_shutter() noexcept override { lit.clear(); }
  std::string lit;

 private:
  std::string name_ = "lamp";
};

/// Gives frames of one level, or two: black + rate * exposure, clipped where a pixel is full.
class FakeCamera final : public devices::Camera {
 public:
  FakeCamera(FakeLight& light, FakeClock& clock) : light_(light), clock_(clock) {}
  const std::string& name() const override { return name_; }
  devices::CameraInfo info() const override {
    devices::CameraInfo info;
    info.model = "fake";
    info.width_px = 32;
    info.height_px = 32;
    info.saturation_level_dn = saturation_level_dn;
    info.min_exposure = std::chrono::microseconds(50);
    info.max_exposure = std::chrono::seconds(10);
    return info;
  }
  devices::Frame capture(std::chrono::nanoseconds exposure) override {
    if (on_capture) on_capture();
    devices::Frame frame;
    frame.width_px = 32;
    frame.height_px = 32;
    frame.saturation_level_dn = saturation_level_dn;
    frame.black_level_dn = 64.0;
    if (gain_db_of_frame) frame.gain_db = gain_db_of_frame(next_id_ + 1);
    frame.exposure = exposure + exposure_error;
    frame.exposure_start = clock_.now();
    clock_.pass(exposure);
    if (!repeat_frame_id) ++next_id_;
    frame.frame_id = next_id_;
    const auto level = [&](double lit) {
      const double rate = light_.lit.empty() ? 0.0 : lit;
      const double dark_dn = bright_behind_the_shutter ? full_dn : 64.0;
      const double dn = dark_dn + rate * std::chrono::duration<double>(exposure).count();
      return static_cast<std::uint16_t>(std::min(dn, full_dn));
    };
    frame.pixels_dn.assign(32 * 32, level(lit_dn_per_s));
    if (upper_half_dn_per_s) {
      std::fill_n(frame.pixels_dn.begin(), 32 * 16, level(*upper_half_dn_per_s));
    }
    for (const std::size_t pixel : full_pixels) {
      frame.pixels_dn[pixel] = static_cast<std::uint16_t>(full_dn);
    }
    exposures.push_back(exposure);
    return frame;
  }

  double lit_dn_per_s = 50000.0;
  std::optional<double> upper_half_dn_per_s;  ///< of the image, where it differs
  std::vector<std::size_t> full_pixels;       ///< whatever the light
  std::uint16_t saturation_level_dn = 4095;   ///< what the camera says
  double full_dn = 4095.0;                    ///< what its pixels do
  std::chrono::nanoseconds exposure_error{0};
  bool repeat_frame_id = false;
  bool bright_behind_the_shutter = false;
  std::function<double(std::uint64_t)> gain_db_of_frame;  ///< by its id; none: 0
  std::function<void()> on_capture;
  std::vector<std::chrono::nanoseconds> exposures;

 private:
  std::string name_ = "camera";
  FakeLight& light_;
  FakeClock& clock_;
  std::uint64_t next_id_ = 0;
};

class FakeChanger final : public devices::TargetChanger {
 public:
  const std::string& name() const override { return name_; }
  devices::Target mounted() const override { return mounted_; }
  void mount(devices::Target target) override { mounted_ = target; }

 private:
  std::string name_ = "changer";
  devices::Target mounted_ = devices::Target::sample;
};

/// A whole LA-2 of them with a 32 x 32 px camera that sees 64 mm.
struct FakeRig {
  FakeRig() {
    known.camera.width_px = 32;
    known.camera.height_px = 32;
    known.camera.fx_px = known.camera.fy_px = 175.0;
    known.camera.cx_px = known.camera.cy_px = 15.5;
    known.sensor.dark_current_e_per_s = 0.0;
    known.sensor.prnu = 0.0;
    known.white.reflectance = {1.0, 1.0, 1.0};
    for (const rig::Axis& axis : known.rig.axes) {
      stages.push_back(std::make_unique<FakeStage>(axis));
      stages.back()->home_angle = axis.home;
    }
  }
  DeviceSet devices() {
    DeviceSet set;
    for (auto& stage : stages) set.stages.push_back(stage.get());
    set.camera = &camera;
    set.light = &light;
    set.changer = &changer;
    set.clock = &clock;
    return set;
  }
  MeasurementPlan plan(const std::vector<std::array<double, 3>>& directions_deg) const {
    return make_plan(rig::Inverse(known.rig), direction_list_deg(directions_deg), 1.0, 10.0);
  }

  instrument::Instrument known = instrument::example_instrument();
  std::vector<std::unique_ptr<FakeStage>> stages;
  FakeClock clock;
  FakeLight light;
  FakeCamera camera{light, clock};
  FakeChanger changer;
};

}  // namespace gonio::acquisition
