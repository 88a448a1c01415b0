#include "simulated_session.h"
#include "directions_deg.h"

namespace gonio {

instrument::Instrument nominal_instrument(const sim::SimOptions& truth) {
  const sim::CameraOptions& camera = truth.camera;
  instrument::Instrument known;
  known.id = "nominal simulated rig";
  known.rig = truth.rig;
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
                  .saturation_dn = static_cast<double>((1 << camera.bits) - 1),
                  .dark_current_e_per_s = camera.dark_current_e_per_s,
                  .prnu = camera.prnu};
  known.vignetting = {camera.vignetting[0], camera.vignetting[1], camera.vignetting[2]};
  known.lamp_field = {truth.lamp.field[0], truth.lamp.field[1], truth.lamp.field[2],
                      truth.lamp.field[3], truth.lamp.field[4]};
  known.white.id = "simulated tile";
  known.white.reflectance = {0.99, 0.99, 0.99};
  known.white.u_relative = 0.005;
  known.u_normal = Angle::from_degrees(0.05);
  known.u_lamp_relative = 0.001;
  return known;
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

acquisition::MeasurementPlan plan_of(const instrument::Instrument& instrument,
                                     const std::vector<std::array<double, 3>>& directions_deg) {
  return acquisition::make_plan(rig::Inverse(instrument.rig), direction_list_deg(directions_deg),
                                5.0, 60.0);
}

}  // namespace gonio
