#pragma once

#include <chrono>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "gonio/aravis_camera/aravis_camera.h"
#include "gonio/aravis_camera/wire_format.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/devices/steady_clock.h"
#include "gonio/emulator_faults/fault_plan.h"
#include "gonio/gige_emulator/gige_camera.h"
#include "gonio/sim/sim_goniometer.h"

namespace gonio::contracts {

/// A world that runs by itself a hundred times faster than real ones, its plate turned to the lamp,
/// an emulated camera that looks at it, and the driver's camera at the other end of the wire.
class EmulatedCamera {
 public:
  static constexpr double kTimeScale = 100.0;

  explicit EmulatedCamera(const std::string& format,
                          std::vector<emulator_faults::FaultRule> faults = {},
                          int packet_size = 9000)
      : EmulatedCamera(options_for(format, packet_size), std::move(faults)) {}

  EmulatedCamera(const aravis_camera::AravisCameraOptions& options,
                 std::vector<emulator_faults::FaultRule> faults)
      : options_(options),
        world_(world_options(aravis_camera::find_wire_format(options.pixel_format)->layout)),
        faults_(std::move(faults)),
        clock_(kTimeScale) {
    using namespace gonio::literals;
    const std::chrono::minutes patience(10);
    for (std::size_t axis = 0; axis < world_.axis_count(); ++axis) {
      world_.stage(axis).home(patience);
    }
    world_.stage(0).begin_move_to(45.0_deg);
    world_.stage(1).begin_move_to(45.0_deg);
    for (std::size_t axis = 0; axis < world_.axis_count(); ++axis) {
      world_.stage(axis).wait_until_settled(patience);
    }
    emulator_ = std::make_unique<gige_emulator::GigeCamera>(
        gige_emulator::GigeCameraOptions{}, world_.camera(), world_.clock(), faults_);
    camera_ = std::make_unique<aravis_camera::AravisCamera>(options_, clock_);
  }

  static aravis_camera::AravisCameraOptions options_for(const std::string& format,
                                                        int packet_size = 9000) {
    aravis_camera::AravisCameraOptions options;
    options.device = "127.0.0.1";
    options.pixel_format = format;
    options.packet_size = packet_size;
    // The emulated camera's converter has 12 bits and counts its black level in them.
    options.black_level_unit_dn =
        std::ldexp(1.0, aravis_camera::find_wire_format(format)->bits - 12);
    options.black_level_dn = 64.0 * options.black_level_unit_dn;
    options.frame_margin = std::chrono::milliseconds(1500);
    return options;
  }

  aravis_camera::AravisCamera& camera() { return *camera_; }
  gige_emulator::GigeCamera& emulator() { return *emulator_; }
  emulator_faults::FaultPlan& faults() { return faults_; }
  sim::SimGoniometer& world() { return world_; }
  devices::LightSource& light() { return world_.light_source(); }
  devices::SteadyClock& clock() { return clock_; }
  double dn_per_adc_step() const { return options_.black_level_unit_dn; }

 private:
  static sim::SimOptions world_options(devices::PixelFormat layout) {
    auto plate = std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.8));
    sim::SimOptions options = sim::nominal_options(std::move(plate), 1);
    options.scene.sample_half_width_mm = 100.0;  // fills the frame
    options.camera.pixel_format = layout;
    if (layout != devices::PixelFormat::mono) {
      options.lamp.channels = sim::LampOptions::white_channel();
    }
    options.time_scale = kTimeScale;
    options.runs_by_itself = true;
    return options;
  }

  aravis_camera::AravisCameraOptions options_;
  sim::SimGoniometer world_;
  emulator_faults::FaultPlan faults_;
  devices::SteadyClock clock_;
  std::unique_ptr<gige_emulator::GigeCamera> emulator_;
  std::unique_ptr<aravis_camera::AravisCamera> camera_;
};

}  // namespace gonio::contracts
