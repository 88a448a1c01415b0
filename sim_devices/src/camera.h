#pragma once

#include <memory>
#include <string>
#include <vector>

#include "changer.h"
#include "gonio/devices/camera.h"
#include "gonio/devices/watchable_camera.h"
#include "gonio/sim/joint.h"
#include "lamp_output.h"
#include "lens.h"
#include "light.h"
#include "radiance.h"
#include "sensor.h"

namespace gonio::sim {

/// What a camera can look at. All must outlive it.
struct CameraView {
  const std::vector<std::unique_ptr<Joint>>& joints;
  const SimLightSource& light;
  const LampOutput& lamp_output;
  const SimTargetChanger& changer;
  VirtualClock& clock;
};

/// The camera: a global shutter that integrates over its exposure, also while axes move.
///
/// Light that is on when the exposure begins stays on until it ends, at the output of its middle.
class SimCamera final : public devices::Camera, public devices::WatchableCamera {
 public:
  SimCamera(const SimOptions& options, const CameraView& view);

  const std::string& name() const override { return name_; }
  devices::CameraInfo info() const override;
  devices::Frame capture(std::chrono::nanoseconds exposure) override {
    return capture(exposure, [] {});
  }
  devices::Frame capture(std::chrono::nanoseconds exposure,
                         const std::function<void()>& meanwhile) override;
  /// Noise is drawn from this index on: SimGoniometer::begin_subject().
  void count_noise_from(std::uint64_t index);

 private:
  double ambient_at(devices::Clock::Duration time) const;
  std::vector<std::uint16_t> picture(devices::Clock::Duration start, devices::Clock::Duration end,
                                     int lit, std::uint64_t noise);
  std::shared_ptr<const RadianceImage> scene_during(devices::Clock::Duration start,
                                                    devices::Clock::Duration end,
                                                    const Bands& bands);
  bool at_rest_during(devices::Clock::Duration start, devices::Clock::Duration end) const;
  rig::Joints joints_at(devices::Clock::Duration time) const;

  CameraOptions options_;
  LampOptions lamp_;
  double ambient_radiance_;
  std::vector<AmbientStep> ambient_steps_;
  CameraView view_;
  RadianceRenderer renderer_;
  Sensor sensor_;
  std::uint64_t next_frame_ = 0;
  std::uint64_t next_noise_ = 0;  ///< names the noise of the next frame
  std::string name_ = "camera";
};

}  // namespace gonio::sim
