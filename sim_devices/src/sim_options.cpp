#include "gonio/sim/sim_options.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include "gonio/random/distributions.h"

namespace gonio::sim {
namespace {

[[noreturn]] void refuse(const std::string& field, double found, const char* expected) {
  throw std::invalid_argument(fmt::format("{}: found {}, expected {}", field, found, expected));
}

void require_positive(const std::string& field, double value) {
  if (!(value > 0.0 && std::isfinite(value))) refuse(field, value, "a positive number");
}

void require_not_negative(const std::string& field, double value) {
  if (!(value >= 0.0 && std::isfinite(value))) refuse(field, value, "zero or a positive number");
}

void require_finite(const std::string& field, double value) {
  if (!std::isfinite(value)) refuse(field, value, "a finite number");
}

void require_between(const std::string& field, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw std::invalid_argument(
        fmt::format("{}: found {}, expected {} .. {}", field, value, low, high));
  }
}

template <typename Duration>
void require_not_negative(const std::string& field, Duration value) {
  if (value < Duration::zero()) {
    refuse(field, static_cast<double>(value.count()), "zero or a positive time");
  }
}

template <typename Duration>
void require_positive(const std::string& field, Duration value) {
  if (value <= Duration::zero()) {
    refuse(field, static_cast<double>(value.count()), "a positive time");
  }
}

}  // namespace

void AxisOptions::validate(const std::string& axis) const {
  const auto field = [&](const char* name) { return fmt::format("axes.{}.{}", axis, name); };
  require_finite(field("zero_offset"), zero_offset.degrees());
  require_not_negative(field("backlash"), backlash.degrees());
  require_not_negative(field("encoder_step"), encoder_step.degrees());
  require_not_negative(field("homing_sigma"), homing_sigma.degrees());
  require_not_negative(field("positioning_sigma"), positioning_sigma.degrees());
  require_finite(field("eccentricity_cos"), eccentricity_cos.degrees());
  require_finite(field("eccentricity_sin"), eccentricity_sin.degrees());
  require_between(field("ring_fraction"), ring_fraction, 0.0, 1.0);
  require_not_negative(field("ring_limit"), ring_limit.degrees());
  require_positive(field("ring_decay"), ring_decay);
  require_not_negative(field("ring_hz"), ring_hz);
  require_not_negative(field("index_search"), index_search);
  if (stands_at) require_finite(field("stands_at"), stands_at->degrees());
  require_finite(field("slip"), slip.degrees());
}

void MountOptions::validate(const std::string& target) const {
  require_between(target + ".tilt_about_x", tilt_about_x.degrees(), -45.0, 45.0);
  require_between(target + ".tilt_about_y", tilt_about_y.degrees(), -45.0, 45.0);
  require_finite(target + ".height_mm", height_mm);
}

void CameraOptions::validate() const {
  constexpr int kMaxSide = 16384;
  require_between("camera.width_px", width_px, 1, kMaxSide);
  require_between("camera.height_px", height_px, 1, kMaxSide);
  require_positive("camera.fx_px", fx_px);
  require_positive("camera.fy_px", fy_px);
  require_finite("camera.cx_px", cx_px);
  require_finite("camera.cy_px", cy_px);
  require_finite("camera.k1", k1);
  require_finite("camera.k2", k2);
  require_finite("camera.p1", p1);
  require_finite("camera.p2", p2);
  require_positive("camera.responsivity_e_per_s", responsivity_e_per_s);
  require_positive("camera.dn_per_electron", dn_per_electron);
  require_not_negative("camera.read_noise_e", read_noise_e);
  require_positive("camera.full_well_e", full_well_e);
  require_between("camera.bits", bits, 8, 16);
  require_between("camera.black_level_dn", black_level_dn, 0.0, std::ldexp(1.0, bits) - 1.0);
  require_not_negative("camera.dark_current_e_per_s", dark_current_e_per_s);
  require_not_negative("camera.dark_current_spread", dark_current_spread);
  require_between("camera.hot_pixel_fraction", hot_pixel_fraction, 0.0, 1.0);
  require_not_negative("camera.hot_pixel_factor", hot_pixel_factor);
  require_between("camera.prnu", prnu, 0.0, 0.2);
  require_not_negative("camera.dsnu_e", dsnu_e);
  for (const double coefficient : vignetting) require_finite("camera.vignetting", coefficient);
  require_between("camera.psf_sigma_px", psf_sigma_px, 0.0, 20.0);
  require_between("camera.nonlinearity", nonlinearity, 0.0, 0.3);
  require_between("camera.polarisation", polarisation, 0.0, 1.0);
  require_finite("camera.polarisation_direction", polarisation_direction.degrees());
  for (const auto& row : bayer_crosstalk) {
    for (const double share : row) require_not_negative("camera.bayer_crosstalk", share);
  }
  require_positive("camera.min_exposure", min_exposure);
  if (max_exposure < min_exposure) {
    refuse("camera.max_exposure", static_cast<double>(max_exposure.count()),
           "at least min_exposure");
  }
  require_positive("camera.exposure_step", exposure_step);
  require_not_negative("camera.readout", readout);
  if (min_exposure + shutter_offset <= std::chrono::nanoseconds::zero()) {
    refuse("camera.shutter_offset", static_cast<double>(shutter_offset.count()),
           "more than -min_exposure");
  }
}

void LampOptions::validate() const {
  if (channels.empty()) throw std::invalid_argument("lamp.channels: found none, expected some");
  std::set<std::string> names;
  for (const LampChannelOptions& channel : channels) {
    if (channel.name.empty() || !names.insert(channel.name).second) {
      throw std::invalid_argument(fmt::format(
          "lamp.channels: found the name \"{}\", expected names of their own", channel.name));
    }
    require_not_negative("lamp.channels." + channel.name + ".wavelength_nm", channel.wavelength_nm);
    for (int band = 0; band < 3; ++band) {
      require_not_negative("lamp.channels." + channel.name + ".intensity_w_per_sr",
                           channel.intensity_w_per_sr[band]);
    }
  }
  for (const double coefficient : field) require_finite("lamp.field", coefficient);
  require_between("lamp.warm_up_amplitude", warm_up_amplitude, 0.0, 1.0);
  require_positive("lamp.warm_up_tau", warm_up_tau);
  require_not_negative("lamp.on_before", on_before);
  require_between("lamp.drift_sigma", drift_sigma, 0.0, 0.1);
  require_positive("lamp.drift_tau", drift_tau);
  require_not_negative("lamp.monitor_sigma", monitor_sigma);
  for (const LampEvent& event : events) {
    require_not_negative("lamp.events.factor", event.factor);
    if (event.over.count() < 0) {
      throw std::invalid_argument(
          fmt::format("lamp.events.over: found {} ns, expected 0 or more", event.over.count()));
    }
  }
  require_not_negative("lamp.stray_fraction", stray_fraction);
  require_positive("lamp.radius_mm", radius_mm);
  require_between("lamp.polarisation", polarisation, 0.0, 1.0);
  require_finite("lamp.polarisation_direction", polarisation_direction.degrees());
}

std::vector<LampChannelOptions> LampOptions::rgb_channels() {
  return {
      {"R", 630.0, {1.0, 0.0, 0.0}}, {"G", 530.0, {0.0, 1.0, 0.0}}, {"B", 465.0, {0.0, 0.0, 1.0}}};
}

std::vector<LampChannelOptions> LampOptions::white_channel() {
  return {{"white", 0.0, {1.0, 1.0, 1.0}}};
}

void BoardOptions::validate() const {
  constexpr int kMaxCells = 4096;
  require_between("scene.board.columns", columns, 0, kMaxCells);
  require_between("scene.board.rows", rows, 0, kMaxCells);
  if (white.size() != static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {
    throw std::invalid_argument(fmt::format("scene.board.white: found {} cells, expected {} x {}",
                                            white.size(), columns, rows));
  }
  require_positive("scene.board.cell_mm", cell_mm);
  require_finite("scene.board.x_mm", x_mm);
  require_finite("scene.board.y_mm", y_mm);
  require_not_negative("scene.board.margin_mm", margin_mm);
  require_between("scene.board.white_albedo", white_albedo, 0.0, 1.0);
  require_between("scene.board.black_albedo", black_albedo, 0.0, 1.0);
}

void PolishedOptions::validate(const std::string& target) const {
  require_positive(target + ".half_width_mm", half_width_mm);
  require_between(target + ".reflectance", reflectance, 0.0, 1.0);
  require_between(target + ".refractive_index", refractive_index, 1.0, 5.0);
  require_between(target + ".diffuse_albedo", diffuse_albedo, 0.0, 1.0);
  require_between(target + ".filter", filter, 0.0, 1.0);
}

void ColourChartOptions::validate() const {
  require_between("scene.colour_chart.columns", columns, 1, 100);
  require_positive("scene.colour_chart.patch_mm", patch_mm);
  require_not_negative("scene.colour_chart.gap_mm", gap_mm);
  for (const brdf::Rgb& albedo : albedos) {
    for (int band = 0; band < 3; ++band) {
      require_between("scene.colour_chart.albedos", albedo[band], 0.0, 1.0);
    }
  }
}

void SceneOptions::validate() const {
  if (!sample) throw std::invalid_argument("scene.sample: found none, expected a BRDF");
  require_positive("scene.sample_half_width_mm", sample_half_width_mm);
  require_positive("scene.white_tile_half_width_mm", white_tile_half_width_mm);
  require_finite("scene.patch_x_mm", patch_x_mm);
  require_finite("scene.patch_y_mm", patch_y_mm);
  require_positive("scene.patch_half_width_mm", patch_half_width_mm);
  require_positive("scene.holder_half_width_mm", holder_half_width_mm);
  require_between("scene.holder_albedo", holder_albedo, 0.0, 1.0);
  require_not_negative("scene.ambient_radiance", ambient_radiance);
  auto last = std::chrono::nanoseconds(0);
  for (const AmbientStep& step : ambient_steps) {
    require_not_negative("scene.ambient_steps.radiance", step.radiance);
    if (step.at < last) {
      throw std::invalid_argument(
          fmt::format("scene.ambient_steps.at: found {} ns after {} ns, expected them in time",
                      step.at.count(), last.count()));
    }
    last = step.at;
  }
  board.validate();
  mirror.validate("scene.mirror");
  black_glass.validate("scene.black_glass");
  require_between("scene.black_trap_albedo", black_trap_albedo, 0.0, 1.0);
  require_positive("scene.black_trap_half_width_mm", black_trap_half_width_mm);
  colour_chart.validate();
}

void SimOptions::validate() const {
  rig.validate();
  if (!axes.empty() && axes.size() != rig.axes.size()) {
    throw std::invalid_argument(
        fmt::format("axes: found {} entries, expected none or one per axis of the rig ({})",
                    axes.size(), rig.axes.size()));
  }
  for (std::size_t axis = 0; axis < axes.size(); ++axis) axes[axis].validate(rig.axes[axis].name);
  sample_mount.validate("sample_mount");
  white_mount.validate("white_mount");
  for (const auto& [target, mount] : mounts) {
    mount.validate(fmt::format("mounts.{}", devices::to_string(target)));
  }
  camera.validate();
  lamp.validate();
  scene.validate();
  require_not_negative("change_time", change_time);
  if (time_scale) require_positive("time_scale", *time_scale);
  if (runs_by_itself && !time_scale) {
    throw std::invalid_argument("time_scale: a world that runs by itself needs one");
  }
}

SimOptions nominal_options(std::shared_ptr<const brdf::BrdfModel> material, std::uint64_t seed) {
  SimOptions options;
  options.rig = rig::la2(350.0, 500.0);
  options.scene.sample = std::move(material);
  options.seed = seed;
  const random::Key key = random::make_key(seed, "sample.mount");
  options.sample_mount.tilt_about_x = Angle::from_degrees(kNominalTiltDeg * random::normal(key, 0));
  options.sample_mount.tilt_about_y = Angle::from_degrees(kNominalTiltDeg * random::normal(key, 1));
  options.validate();
  return options;
}

}  // namespace gonio::sim
