#include "gonio/setup/simulated_rig.h"

#include <algorithm>
#include <cmath>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/instrument/calibration_file.h"
#include "narrower_rig.h"

namespace gonio::cli {
namespace {

/// Relative, k = 1: what lamp monitor and field are trusted to on a rig that was not calibrated.
constexpr double kNominalLampUncertainty = 0.001;

}  // namespace

sim::SimOptions simulated_world(const RigFile& file,
                                std::shared_ptr<const brdf::BrdfModel> material,
                                std::uint64_t seed) {
  const sim::SimOptions nominal = sim::nominal_options(material, seed);
  sim::SimOptions world = file.world;
  world.rig = file.rig;
  world.scene.sample = std::move(material);
  world.seed = seed;
  world.axes.assign(file.rig.axes.size(), file.axis_errors);
  // A target is a little larger than the part of it that is used.
  constexpr double kSampleRim_mm = 2.0;
  constexpr double kWhiteRim_mm = 4.0;
  constexpr double kPatchRim_mm = 1.0;
  const double sample_mm = file.session.sample_half_width_mm;
  world.scene.sample_half_width_mm = sample_mm + kSampleRim_mm;
  world.scene.white_tile_half_width_mm =
      file.session.white_half_width_mm.value_or(sample_mm) + kWhiteRim_mm;
  world.scene.patch_half_width_mm = file.session.white_patch_half_width_mm + kPatchRim_mm;
  // The certificate is true of the simulated tile and patch.
  world.scene.white_tile = std::make_shared<brdf::Lambertian>(file.white.reflectance);
  world.scene.patch = world.scene.white_tile;
  world.scene.patch_x_mm = file.session.white_patch_mm.x();
  world.scene.patch_y_mm = file.session.white_patch_mm.y();
  // The same draw as the nominal world's, at this file's size.
  const double size = file.tilt_rms / Angle::from_degrees(sim::kNominalTiltDeg);
  world.sample_mount.tilt_about_x = nominal.sample_mount.tilt_about_x * size;
  world.sample_mount.tilt_about_y = nominal.sample_mount.tilt_about_y * size;
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
  known.white = file.white;
  known.u_normal = file.tilt_rms;
  known.u_lamp_relative = kNominalLampUncertainty;
  return known;
}

instrument::Instrument instrument_of(const RigFile& file, const std::string& calibration) {
  std::filesystem::path path = calibration;
  if (path.empty() && !file.calibration.empty()) {
    path = file.path.parent_path() / file.calibration;
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
  return devices;
}

}  // namespace gonio::cli
