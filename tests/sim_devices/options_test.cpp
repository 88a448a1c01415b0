#include "gonio/sim/sim_options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "worlds.h"

namespace gonio::sim {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

struct BadOption {
  const char* field;
  std::function<void(SimOptions&)> spoil;
};

class SimOptionsRefuse : public testing::TestWithParam<BadOption> {};

TEST_P(SimOptionsRefuse, ABadValueByTheNameOfItsField) {
  SimOptions options = ideal_options(0.5);
  options.validate();
  GetParam().spoil(options);
  try {
    options.validate();
    FAIL() << "accepted a bad " << GetParam().field;
  } catch (const std::invalid_argument& error) {
    EXPECT_THAT(error.what(), testing::HasSubstr(GetParam().field));
    EXPECT_THAT(error.what(), testing::Not(testing::HasSubstr("\n")));
  }
}

const BadOption kBadOptions[] = {
    {"axes", [](SimOptions& o) { o.axes.resize(2); }},
    {"axes.tilt.backlash", [](SimOptions& o) { o.axes[2].backlash = -1.0_deg; }},
    {"axes.azimuth.zero_offset",
     [](SimOptions& o) { o.axes[1].zero_offset = Angle::from_degrees(kNan); }},
    {"axes.lamp_arm.encoder_step", [](SimOptions& o) { o.axes[0].encoder_step = -1.0_deg; }},
    {"axes.lamp_arm.homing_sigma", [](SimOptions& o) { o.axes[0].homing_sigma = -1.0_deg; }},
    {"axes.lamp_arm.positioning_sigma",
     [](SimOptions& o) { o.axes[0].positioning_sigma = -1.0_deg; }},
    {"axes.lamp_arm.eccentricity_cos",
     [](SimOptions& o) { o.axes[0].eccentricity_cos = Angle::from_degrees(kNan); }},
    {"axes.lamp_arm.ring_fraction", [](SimOptions& o) { o.axes[0].ring_fraction = 2.0; }},
    {"axes.lamp_arm.ring_decay", [](SimOptions& o) { o.axes[0].ring_decay = 0ms; }},
    {"axes.lamp_arm.index_search", [](SimOptions& o) { o.axes[0].index_search = -1ms; }},
    {"sample_mount.tilt_about_x", [](SimOptions& o) { o.sample_mount.tilt_about_x = 90.0_deg; }},
    {"white_mount.height_mm", [](SimOptions& o) { o.white_mount.height_mm = kNan; }},
    {"camera.width_px", [](SimOptions& o) { o.camera.width_px = 0; }},
    {"camera.height_px", [](SimOptions& o) { o.camera.height_px = 100000; }},
    {"camera.fx_px", [](SimOptions& o) { o.camera.fx_px = 0.0; }},
    {"camera.cy_px", [](SimOptions& o) { o.camera.cy_px = kNan; }},
    {"camera.k2", [](SimOptions& o) { o.camera.k2 = kNan; }},
    {"camera.responsivity_e_per_s", [](SimOptions& o) { o.camera.responsivity_e_per_s = 0.0; }},
    {"camera.dn_per_electron", [](SimOptions& o) { o.camera.dn_per_electron = -0.39; }},
    {"camera.read_noise_e", [](SimOptions& o) { o.camera.read_noise_e = -1.0; }},
    {"camera.full_well_e", [](SimOptions& o) { o.camera.full_well_e = kNan; }},
    {"camera.bits", [](SimOptions& o) { o.camera.bits = 17; }},
    {"camera.black_level_dn", [](SimOptions& o) { o.camera.black_level_dn = 70000.0; }},
    {"camera.dark_current_e_per_s", [](SimOptions& o) { o.camera.dark_current_e_per_s = -1.0; }},
    {"camera.hot_pixel_fraction", [](SimOptions& o) { o.camera.hot_pixel_fraction = 1.1; }},
    {"camera.prnu", [](SimOptions& o) { o.camera.prnu = -0.1; }},
    {"camera.vignetting", [](SimOptions& o) { o.camera.vignetting[1] = kNan; }},
    {"camera.psf_sigma_px", [](SimOptions& o) { o.camera.psf_sigma_px = 1e9; }},
    {"camera.nonlinearity", [](SimOptions& o) { o.camera.nonlinearity = 1.0; }},
    {"camera.bayer_crosstalk", [](SimOptions& o) { o.camera.bayer_crosstalk[0][1] = -0.1; }},
    {"camera.min_exposure", [](SimOptions& o) { o.camera.min_exposure = 0ns; }},
    {"camera.max_exposure", [](SimOptions& o) { o.camera.max_exposure = 1us; }},
    {"camera.exposure_step", [](SimOptions& o) { o.camera.exposure_step = 0ns; }},
    {"camera.readout", [](SimOptions& o) { o.camera.readout = -1ns; }},
    {"camera.shutter_offset", [](SimOptions& o) { o.camera.shutter_offset = -1ms; }},
    {"lamp.channels", [](SimOptions& o) { o.lamp.channels.clear(); }},
    {"lamp.channels", [](SimOptions& o) { o.lamp.channels[1].name = "R"; }},
    {"lamp.channels.R.intensity_w_per_sr",
     [](SimOptions& o) { o.lamp.channels[0].intensity_w_per_sr[2] = -1.0; }},
    {"lamp.field", [](SimOptions& o) { o.lamp.field[4] = kNan; }},
    {"lamp.warm_up_amplitude", [](SimOptions& o) { o.lamp.warm_up_amplitude = 1.5; }},
    {"lamp.warm_up_tau", [](SimOptions& o) { o.lamp.warm_up_tau = 0s; }},
    {"lamp.drift_sigma", [](SimOptions& o) { o.lamp.drift_sigma = -0.1; }},
    {"lamp.drift_tau", [](SimOptions& o) { o.lamp.drift_tau = 0s; }},
    {"lamp.monitor_sigma", [](SimOptions& o) { o.lamp.monitor_sigma = -1.0; }},
    {"lamp.stray_fraction", [](SimOptions& o) { o.lamp.stray_fraction = -1.0; }},
    {"scene.sample", [](SimOptions& o) { o.scene.sample = nullptr; }},
    {"scene.sample_half_width_mm", [](SimOptions& o) { o.scene.sample_half_width_mm = 0.0; }},
    {"scene.patch_x_mm", [](SimOptions& o) { o.scene.patch_x_mm = kNan; }},
    {"scene.holder_albedo", [](SimOptions& o) { o.scene.holder_albedo = 2.0; }},
    {"scene.ambient_radiance", [](SimOptions& o) { o.scene.ambient_radiance = -1.0; }},
    {"scene.ambient_steps.radiance",
     [](SimOptions& o) {
       o.scene.ambient_steps = {{1s, -1.0}};
     }},
    {"scene.ambient_steps.at",
     [](SimOptions& o) {
       o.scene.ambient_steps = {{2s, 1.0}, {1s, 0.0}};
     }},
    {"change_time", [](SimOptions& o) { o.change_time = -1ms; }},
    {"time_scale", [](SimOptions& o) { o.time_scale = 0.0; }},
};

INSTANTIATE_TEST_SUITE_P(All, SimOptionsRefuse, testing::ValuesIn(kBadOptions));

TEST(SimOptions, WorldOfBadOptionsIsNeverBuilt) {
  SimOptions options = ideal_options(0.5);
  options.camera.bits = 3;
  EXPECT_THROW(SimGoniometer{options}, std::invalid_argument);
  EXPECT_THROW(nominal_options(nullptr, 1), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::sim
