#pragma once

#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <numbers>
#include <vector>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/calibration/board/board_spec.h"
#include "gonio/calibration/board/detect.h"
#include "gonio/sim/sim_goniometer.h"

/// The board in the simulated rig, and where its corners are in the picture.
namespace gonio::calibration::board::test {

using devices::Target;

inline constexpr std::chrono::milliseconds kExposure{25};      // the white comes to half saturation
inline constexpr std::chrono::milliseconds kPatience{600000};  // of virtual time

/// LA-2 with the camera 350 mm from the axes, on +x.
inline constexpr double kCameraMm = 350.0;

/// Azimuth and tilt of the board.
struct Pose {
  double azimuth_deg;
  double tilt_deg;
};

/// A camera of `scale` quarters of the real one's size, its noise, falloff and a lens that blurs;
/// axes that stand exactly where they say. The image's middle lies between pixels.
inline sim::SimOptions options_with_board(const BoardSpec& spec, int scale = 1) {
  sim::SimOptions options = sim::nominal_options(
      std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.5)), /*seed=*/11);
  options.sample_mount = {};
  sim::AxisOptions axis;
  axis.encoder_step = Angle();
  axis.homing_sigma = Angle();
  axis.positioning_sigma = Angle();
  axis.ring_fraction = 0.0;
  options.axes.assign(options.rig.axes.size(), axis);

  sim::CameraOptions& camera = options.camera;
  camera.width_px = 612 * scale;
  camera.height_px = 512 * scale;
  camera.fx_px = camera.fy_px = 1381.0 * scale;
  camera.cx_px = 305.3 * scale;
  camera.cy_px = 254.8 * scale;
  camera.psf_sigma_px = 0.6;

  const BoardCells cells = board_cells(spec);
  sim::BoardOptions& board = options.scene.board;
  board.columns = cells.columns;
  board.rows = cells.rows;
  board.white = cells.white;
  board.cell_mm = spec.cell_mm();
  return options;
}

/// One frame under green light from beside the camera.
inline devices::Frame picture_of(const sim::SimOptions& options, Pose pose,
                                 std::chrono::nanoseconds exposure = kExposure,
                                 Target target = Target::board) {
  sim::SimGoniometer world(options);
  world.target_changer().mount(target);
  const std::array<double, 3> joints_deg{10.0, pose.azimuth_deg, pose.tilt_deg};
  for (std::size_t axis = 0; axis < joints_deg.size(); ++axis) {
    world.stage(axis).home(kPatience);
    world.stage(axis).begin_move_to(Angle::from_degrees(joints_deg[axis]));
    world.stage(axis).wait_until_settled(kPatience);
  }
  world.light_source().light("G");
  return world.camera().capture(exposure);
}

inline BoardImage image_of(const devices::Frame& frame) {
  return {frame.pixels_dn, frame.width_px, frame.height_px,
          static_cast<double>(frame.saturation_level_dn)};
}

/// Where the camera sees a point (right, up) of the board, by turning it about the tilt axis (y of
/// the world at azimuth 0), then about the azimuth axis z, and drawing the line to the camera on
/// +x, whose picture has y of the world to the right and z up.
inline std::array<double, 2> projected_px(const sim::CameraOptions& camera, Pose pose,
                                          double right_mm, double up_mm) {
  constexpr double kDeg = std::numbers::pi / 180.0;
  const double back = up_mm * std::sin(pose.tilt_deg * kDeg);
  const double z = up_mm * std::cos(pose.tilt_deg * kDeg);
  const double azimuth = pose.azimuth_deg * kDeg;
  const double x = -back * std::cos(azimuth) - right_mm * std::sin(azimuth);
  const double y = -back * std::sin(azimuth) + right_mm * std::cos(azimuth);
  return {camera.cx_px + camera.fx_px * y / (kCameraMm - x),
          camera.cy_px - camera.fy_px * z / (kCameraMm - x)};
}

}  // namespace gonio::calibration::board::test
