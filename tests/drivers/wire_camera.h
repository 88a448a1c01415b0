#pragma once

#include <atomic>
#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/aravis_camera/wire_format.h"
#include "gonio/devices/steady_clock.h"
#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/gige_emulator/gige_camera.h"

namespace gonio::aravis_camera {

/// What the emulated camera looks at where a test wants to know every pixel: 12 bit numbers that
/// depend on place only, but for the first pixel, which counts the exposures.
class PatternCamera final : public devices::Camera {
 public:
  PatternCamera(devices::Clock& clock, devices::PixelFormat format, int width, int height)
      : clock_(clock), format_(format), width_(width), height_(height) {}

  static std::uint16_t value(int row, int column) {
    return static_cast<std::uint16_t>((row * 1031 + column * 37 + 129) % 4096);
  }

  const std::string& name() const override { return name_; }

  devices::CameraInfo info() const override {
    devices::CameraInfo info;
    info.model = "pattern";
    info.serial = "P-0001";
    info.width_px = width_;
    info.height_px = height_;
    info.pixel_format = format_;
    info.saturation_level_dn = 4095;
    info.min_exposure = std::chrono::microseconds(50);
    info.max_exposure = std::chrono::seconds(10);
    return info;
  }

  devices::Frame still() const {
    devices::Frame frame;
    frame.width_px = width_;
    frame.height_px = height_;
    frame.pixel_format = format_;
    frame.saturation_level_dn = 4095;
    frame.black_level_dn = 64.0;
    frame.pixels_dn.reserve(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
    for (int row = 0; row < height_; ++row) {
      for (int column = 0; column < width_; ++column) frame.pixels_dn.push_back(value(row, column));
    }
    return frame;
  }

  /// Exposures begun so far.
  int begun() const { return begun_; }

  devices::Frame capture(std::chrono::nanoseconds exposure) override {
    ++begun_;
    clock_.wait_until(clock_.now() + exposure);
    devices::Frame frame = still();
    frame.exposure = exposure;
    frame.pixels_dn.front() = ++exposures_;
    return frame;
  }

 private:
  devices::Clock& clock_;
  devices::PixelFormat format_;
  int width_;
  int height_;
  std::atomic<int> begun_ = 0;
  std::uint16_t exposures_ = 0;
  std::string name_ = "pattern";
};

/// An emulated camera at 127.0.0.1 and what the driver needs to open it.
class WireCamera {
 public:
  explicit WireCamera(const std::string& format = "Mono12",
                      std::vector<emulator_faults::FaultRule> faults = {}, double time_scale = 20.0,
                      int width = 320, int height = 256)
      : clock_(time_scale),
        pattern_(clock_, find_wire_format(format)->layout, width, height),
        faults_(std::move(faults)),
        emulator_(std::make_unique<gige_emulator::GigeCamera>(gige_emulator::GigeCameraOptions{},
                                                              pattern_, clock_, faults_)) {
    options_.device = "127.0.0.1";
    options_.pixel_format = format;
    options_.packet_size = 9000;
    // The emulated camera's converter has 12 bits and counts its black level in them.
    options_.black_level_unit_dn = std::ldexp(1.0, find_wire_format(format)->bits - 12);
    options_.black_level_dn = 64.0 * options_.black_level_unit_dn;
    options_.frame_margin = std::chrono::milliseconds(600);
  }

  AravisCameraOptions& options() { return options_; }
  AravisCamera open() const { return AravisCamera(options_, clock_); }

  gige_emulator::GigeCamera& emulator() { return *emulator_; }
  emulator_faults::FaultPlan& faults() { return faults_; }
  const PatternCamera& pattern() const { return pattern_; }
  devices::SteadyClock& clock() { return clock_; }

 private:
  devices::SteadyClock clock_;
  PatternCamera pattern_;
  emulator_faults::FaultPlan faults_;
  std::unique_ptr<gige_emulator::GigeCamera> emulator_;
  AravisCameraOptions options_;
};

}  // namespace gonio::aravis_camera
