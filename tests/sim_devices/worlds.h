#pragma once

#include <chrono>
#include <memory>
#include <vector>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/sim/sim_goniometer.h"

namespace gonio::sim {

using namespace gonio::literals;
using namespace std::chrono_literals;

inline constexpr std::chrono::milliseconds kPatience{600000};  // of virtual time

enum Axis : std::size_t { kLampArm, kAzimuth, kTilt };

/// The demonstration's rig without a single imperfection, and so much light in so small portions
/// that shot noise drops out of sight (1e8 electrons for one): what is left is exact to 1e-4.
inline SimOptions ideal_options(double albedo) {
  SimOptions options =
      nominal_options(std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(albedo)), 1);
  options.sample_mount = {};
  AxisOptions axis;
  axis.encoder_step = Angle();
  axis.homing_sigma = Angle();
  axis.positioning_sigma = Angle();
  axis.ring_fraction = 0.0;
  options.axes.assign(options.rig.axes.size(), axis);

  constexpr double kPortions = 1e8;
  CameraOptions& camera = options.camera;
  camera.responsivity_e_per_s *= kPortions;
  camera.dn_per_electron /= kPortions;
  camera.full_well_e *= kPortions;
  camera.bits = 16;
  camera.read_noise_e = 0.0;
  camera.dark_current_e_per_s = 0.0;
  camera.hot_pixel_fraction = 0.0;
  camera.prnu = 0.0;
  camera.dsnu_e = 0.0;
  camera.vignetting = {0.0, 0.0, 0.0};
  camera.cx_px = 160.0;  // so that a pixel lies on the axis
  camera.cy_px = 128.0;
  options.lamp.field = {};
  options.lamp.warm_up_amplitude = 0.0;
  options.lamp.drift_sigma = 0.0;
  options.lamp.monitor_sigma = 0.0;
  return options;
}

inline constexpr int kCentreRow = 128;
inline constexpr int kCentreColumn = 160;

inline void home(SimGoniometer& world) {
  for (std::size_t axis = 0; axis < world.axis_count(); ++axis) world.stage(axis).home(kPatience);
}

inline void move_to(SimGoniometer& world, const std::vector<Angle>& joints) {
  for (std::size_t axis = 0; axis < joints.size(); ++axis) {
    world.stage(axis).begin_move_to(joints[axis]);
  }
  for (std::size_t axis = 0; axis < joints.size(); ++axis) {
    world.stage(axis).wait_until_settled(kPatience);
  }
}

/// One frame of the pose under a channel.
inline devices::Frame picture(SimGoniometer& world, const std::vector<Angle>& joints,
                              std::chrono::nanoseconds exposure = 10ms,
                              const std::string& channel = "G") {
  home(world);
  move_to(world, joints);
  world.light_source().light(channel);
  return world.camera().capture(exposure);
}

/// Tolerance of a pixel in ideal_options(): half a DN of quantisation and four sigmas of the shot
/// noise that is left (0.15 DN at 500).
inline constexpr double kDn = 0.7;

/// DN above the black level.
inline double dn(const devices::Frame& frame, int row, int column) {
  return frame.at(row, column) - frame.black_level_dn;
}

/// The same at the pixel on the optical axis.
inline double centre_dn(const devices::Frame& frame) {
  return dn(frame, kCentreRow, kCentreColumn);
}

}  // namespace gonio::sim
