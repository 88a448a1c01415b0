#pragma once

#include <cmath>
#include <memory>
#include <string>

#include "gonio/acquisition/session.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/calibration/routine/routine.h"
#include "gonio/sim/hidden_options.h"
#include "gonio/sim/sim_goniometer.h"

namespace gonio::calibration::routine::test {

/// When every calibration of a hidden world is made.
inline constexpr instrument::UtcSeconds kNoon{std::chrono::seconds(1'700'000'000)};

/// A hidden world, and what an operator knows of it.
struct HiddenBench {
  explicit HiddenBench(std::uint64_t seed, sim::HiddenImage size = sim::HiddenImage::small)
      : HiddenBench(options_with_board(seed, size)) {}

  explicit HiddenBench(const sim::SimOptions& options) : world(options) {
    for (std::size_t i = 0; i < world.axis_count(); ++i) devices.stages.push_back(&world.stage(i));
    devices.camera = &world.camera();
    devices.light = &world.light_source();
    devices.monitor = &world.lamp_monitor();
    devices.changer = &world.target_changer();
    devices.clock = &world.clock();
  }

  static sim::SimOptions options_with_board(std::uint64_t seed, sim::HiddenImage size) {
    sim::SimOptions options = sim::hidden_options(
        std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(0.5)), seed, size);
    const board::BoardSpec spec;
    const board::BoardCells cells = board::board_cells(spec);
    options.scene.board.columns = cells.columns;
    options.scene.board.rows = cells.rows;
    options.scene.board.white = cells.white;
    options.scene.board.cell_mm = spec.cell_mm();
    return options;
  }

  /// The drawing and the data sheets, and the white's certificate.
  static instrument::Instrument nominal(sim::HiddenImage size) {
    instrument::Instrument known;
    known.id = "nominal";
    known.rig = rig::la2(350.0, 500.0);
    const bool full = size == sim::HiddenImage::full_size;
    known.camera.width_px = full ? 2448 : 612;
    known.camera.height_px = full ? 2048 : 512;
    known.camera.fx_px = known.camera.fy_px = full ? 5525.0 : 1381.0;
    known.camera.cx_px = 0.5 * (known.camera.width_px - 1);
    known.camera.cy_px = 0.5 * (known.camera.height_px - 1);
    known.sensor = {.gain_dn_per_e = 0.39,
                    .read_noise_e = 2.4,
                    .full_well_e = 10'300.0,
                    .black_level_dn = 64.0,
                    .saturation_dn = 4000.0,
                    .dark_current_e_per_s = 5.0,
                    .prnu = 0.006};
    known.white.id = "tile";
    const sim::WhiteCertificate certificate = sim::hidden_white();
    known.white.reflectance = certificate.reflectance;
    const auto degrees = [](const std::vector<Angle>& nodes) {
      std::vector<double> values;
      for (const Angle node : nodes) values.push_back(node.degrees());
      return values;
    };
    known.white.angular = {degrees(certificate.angular.theta_i),
                           degrees(certificate.angular.theta_o),
                           degrees(certificate.angular.delta_phi), certificate.angular.factor};
    known.white.u_relative = certificate.u_relative;
    known.u_normal = Angle::from_degrees(0.3);
    known.u_joint = Angle::from_degrees(0.003);
    known.u_lamp_relative = 0.01;
    return known;
  }

  static RoutineSettings settings() {
    RoutineSettings settings;
    for (const brdf::Rgb& albedo : sim::hidden_chart()) {
      settings.chart.linear_srgb.emplace_back(albedo.matrix());
    }
    return settings;
  }

  sim::SimGoniometer world;
  acquisition::DeviceSet devices;
};

}  // namespace gonio::calibration::routine::test
