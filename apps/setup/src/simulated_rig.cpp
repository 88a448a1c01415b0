#include "gonio/setup/simulated_rig.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/calibration/board/board_spec.h"
#include "gonio/console/failures.h"
#include "gonio/instrument/calibration_file.h"
#include "gonio/setup/white_certificate.h"
#include "gonio/sim/angular_white.h"
#include "gonio/sim/hidden_options.h"
#include "narrower_rig.h"

namespace gonio::cli {
namespace {

/// Relative, k = 1: what lamp monitor and field are trusted to on a rig that was not calibrated.
constexpr double kNominalLampUncertainty = 0.001;
/// How well stages of the usual kind repeat, k = 1.
constexpr Angle kNominalJointScatter = Angle::from_degrees(0.003);

std::vector<double> degrees_of(const std::vector<Angle>& angles) {
  std::vector<double> degrees;
  for (const Angle angle : angles) degrees.push_back(angle.degrees());
  return degrees;
}

std::vector<Angle> angles_of(const std::vector<double>& degrees) {
  std::vector<Angle> angles;
  for (const double each : degrees) angles.push_back(Angle::from_degrees(each));
  return angles;
}

/// The certificate is true of the simulated tile and patch.
std::shared_ptr<const brdf::BrdfModel> true_white(const instrument::WhiteReference& white) {
  if (white.angular.empty()) return std::make_shared<brdf::Lambertian>(white.reflectance);
  const instrument::AngularTable& table = white.angular;
  return std::make_shared<sim::AngularWhite>(
      white.reflectance,
      sim::AngularFactor{angles_of(table.theta_i_deg), angles_of(table.theta_o_deg),
                         angles_of(table.delta_phi_deg), table.factor});
}

/// As the rig file says, with errors of the sizes it says.
sim::SimOptions described_world(const RigFile& file,
                                const std::shared_ptr<const brdf::BrdfModel>& material,
                                std::uint64_t seed) {
  const sim::SimOptions nominal = sim::nominal_options(material, seed);
  sim::SimOptions world = file.world;
  world.rig = file.rig;
  world.scene.sample = material;
  world.axes.assign(file.rig.axes.size(), file.axis_errors);
  // The same draw as the nominal world's, at this file's size.
  const double size = file.tilt_rms / Angle::from_degrees(sim::kNominalTiltDeg);
  world.sample_mount.tilt_about_x = nominal.sample_mount.tilt_about_x * size;
  world.sample_mount.tilt_about_y = nominal.sample_mount.tilt_about_y * size;
  return world;
}

/// Off what the rig file says by what a calibration has to find.
sim::SimOptions hidden_world(const RigFile& file,
                             const std::shared_ptr<const brdf::BrdfModel>& material,
                             std::uint64_t seed) {
  sim::SimOptions world = sim::hidden_options(material, seed);
  // This file's axes as planning sees them and its distances, with the misalignments.
  const rig::RigDescription aligned = rig::la2();
  world.rig.axes = file.rig.axes;
  world.rig.camera.home_pose =
      file.rig.camera.home_pose * (aligned.camera.home_pose.inverse() * world.rig.camera.home_pose);
  world.rig.lamp.home_pose =
      file.rig.lamp.home_pose * (aligned.lamp.home_pose.inverse() * world.rig.lamp.home_pose);
  // The same errors of lens and sensor, in a window of this file's size and at its resolution.
  const sim::CameraOptions drawn = world.camera;
  const sim::CameraOptions& nominal = file.world.camera;
  const sim::CameraOptions plain = sim::nominal_options(material, seed).camera;
  sim::CameraOptions& camera = world.camera;
  const double finer = nominal.fx_px / plain.fx_px;
  camera.width_px = nominal.width_px;
  camera.height_px = nominal.height_px;
  camera.fx_px = drawn.fx_px * finer;
  camera.fy_px = drawn.fy_px * finer;
  camera.cx_px = nominal.cx_px + (drawn.cx_px - 0.5 * (drawn.width_px - 1)) * finer;
  camera.cy_px = nominal.cy_px + (drawn.cy_px - 0.5 * (drawn.height_px - 1)) * finer;
  camera.min_exposure = nominal.min_exposure;
  camera.max_exposure = nominal.max_exposure;
  camera.readout = nominal.readout;
  camera.bits = nominal.bits;
  camera.black_level_dn = nominal.black_level_dn;
  camera.dn_per_electron *= nominal.dn_per_electron / plain.dn_per_electron;
  camera.full_well_e *= nominal.full_well_e / plain.full_well_e;
  camera.responsivity_e_per_s *= nominal.responsivity_e_per_s / plain.responsivity_e_per_s;
  camera.polarisation = nominal.polarisation;
  camera.polarisation_direction = nominal.polarisation_direction;
  world.lamp.polarisation = file.world.lamp.polarisation;
  world.lamp.polarisation_direction = file.world.lamp.polarisation_direction;
  world.scene.ambient_radiance = file.world.scene.ambient_radiance;
  world.change_time = file.world.change_time;
  world.time_scale = file.world.time_scale;
  return world;
}

}  // namespace

instrument::WhiteReference white_of(const RigFile& file) {
  instrument::WhiteReference white = file.white;
  if (file.hidden) {
    const sim::WhiteCertificate certificate = sim::hidden_white();
    white.reflectance = certificate.reflectance;
    white.u_relative = certificate.u_relative;
    white.angular = {degrees_of(certificate.angular.theta_i),
                     degrees_of(certificate.angular.theta_o),
                     degrees_of(certificate.angular.delta_phi), certificate.angular.factor};
  } else if (!file.certificate.empty()) {
    white.angular = read_white_certificate(file.path.parent_path() / file.certificate);
  }
  return white;
}

sim::SimOptions simulated_world(const RigFile& file,
                                std::shared_ptr<const brdf::BrdfModel> material,
                                std::uint64_t seed) {
  sim::SimOptions world =
      file.hidden ? hidden_world(file, material, seed) : described_world(file, material, seed);
  world.seed = seed;
  world.same_noise_again = file.world.same_noise_again;
  // Without drift the lamp is also warm: its light is the same at any time.
  if (world.lamp.drift_sigma == 0.0) world.lamp.warm_up_amplitude = 0.0;
  // A target is a little larger than the part of it that is used.
  constexpr double kSampleRim_mm = 2.0;
  constexpr double kWhiteRim_mm = 4.0;
  constexpr double kPatchRim_mm = 1.0;
  const double sample_mm = file.session.sample_half_width_mm;
  world.scene.sample_half_width_mm = sample_mm + kSampleRim_mm;
  world.scene.white_tile_half_width_mm =
      file.session.white_half_width_mm.value_or(sample_mm) + kWhiteRim_mm;
  world.scene.patch_half_width_mm = file.session.white_patch_half_width_mm + kPatchRim_mm;
  world.scene.white_tile = true_white(white_of(file));
  world.scene.patch = world.scene.white_tile;
  world.scene.patch_x_mm = file.session.white_patch_mm.x();
  world.scene.patch_y_mm = file.session.white_patch_mm.y();
  // What an operator has at hand for a calibration.
  const calibration::board::BoardSpec board;
  const calibration::board::BoardCells cells = calibration::board::board_cells(board);
  world.scene.board.columns = cells.columns;
  world.scene.board.rows = cells.rows;
  world.scene.board.white = cells.white;
  world.scene.board.cell_mm = board.cell_mm();
  const sim::SceneOptions bench = sim::hidden_options(material, seed).scene;
  world.scene.black_glass = bench.black_glass;
  world.scene.colour_chart = bench.colour_chart;
  return world;
}

instrument::Instrument nominal_instrument(const RigFile& file) {
  const sim::CameraOptions& camera = file.world.camera;
  const sim::LampOptions& lamp = file.world.lamp;
  instrument::Instrument known;
  known.id = "nominal constants of " + file.rig.name;
  known.rig = file.rig;
  known.camera = {.width_px = camera.width_px,
                  .height_px = camera.height_px,
                  .fx_px = camera.fx_px,
                  .fy_px = camera.fy_px,
                  .cx_px = camera.cx_px,
                  .cy_px = camera.cy_px,
                  .k1 = camera.k1,
                  .k2 = camera.k2,
                  .p1 = camera.p1,
                  .p2 = camera.p2};
  known.sensor = {.gain_dn_per_e = camera.dn_per_electron,
                  .read_noise_e = camera.read_noise_e,
                  .full_well_e = camera.full_well_e,
                  .black_level_dn = camera.black_level_dn,
                  .saturation_dn =
                      std::min(std::ldexp(1.0, camera.bits) - 1.0,
                               camera.black_level_dn + camera.dn_per_electron * camera.full_well_e),
                  .dark_current_e_per_s = camera.dark_current_e_per_s,
                  .prnu = camera.prnu};
  known.vignetting = {camera.vignetting[0], camera.vignetting[1], camera.vignetting[2]};
  known.lamp_field = {lamp.field[0], lamp.field[1], lamp.field[2], lamp.field[3], lamp.field[4]};
  known.white = white_of(file);
  known.u_normal = file.tilt_rms;
  known.u_joint = kNominalJointScatter;
  known.u_lamp_relative = kNominalLampUncertainty;
  return known;
}

std::filesystem::path calibration_place(const RigFile& file, const std::string& calibration) {
  if (calibration.empty() && file.calibration.empty()) return {};
  const std::filesystem::path named = calibration.empty()
                                          ? file.path.parent_path() / file.calibration
                                          : std::filesystem::path(calibration);
  // The constants in a calibration folder stand for the folder: their age is in its archive. So do
  // links to them.
  std::error_code broken;  // reading tells
  const std::filesystem::path real =
      std::filesystem::is_symlink(named) ? std::filesystem::canonical(named, broken) : named;
  const std::filesystem::path folder = real.has_parent_path() ? real.parent_path() : ".";
  const bool of_a_folder =
      real.filename() == "instrument.json" && std::filesystem::exists(folder / "calibration.json");
  return of_a_folder ? folder : named;
}

instrument::Instrument instrument_of(const RigFile& file, const std::string& calibration) {
  std::filesystem::path path = calibration_place(file, calibration);
  if (std::filesystem::is_directory(path)) {
    const std::filesystem::path folder = path;
    path /= "instrument.json";
    if (!std::filesystem::exists(path)) {
      throw UsageError(folder.string() +
                           ": found a folder without instrument.json, expected a file "
                           "of constants or a calibration whose steps have all passed",
                       "gonio calibrate RIG --out FOLDER takes the steps that are missing");
    }
  }
  if (path.empty()) return nominal_instrument(file);
  instrument::Instrument known = instrument::read_calibration(path);
  known.rig = narrower_rig(known.rig, path, file.rig, file.path);
  return known;
}

KnownRig known_rig(const std::filesystem::path& file, const std::string& calibration) {
  KnownRig rig{read_rig_file(file), {}};
  rig.constants = instrument_of(rig.file, calibration);
  return rig;
}

acquisition::DeviceSet devices_of(sim::SimGoniometer& world) {
  acquisition::DeviceSet devices;
  for (std::size_t i = 0; i < world.axis_count(); ++i) devices.stages.push_back(&world.stage(i));
  devices.camera = &world.camera();
  devices.light = &world.light_source();
  devices.monitor = &world.lamp_monitor();
  devices.changer = &world.target_changer();
  devices.clock = &world.clock();
  devices.begin_subject = [&world](std::uint64_t subject) { world.begin_subject(subject); };
  return devices;
}

}  // namespace gonio::cli
