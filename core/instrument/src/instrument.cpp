#include "gonio/instrument/instrument.h"

#include <fmt/format.h>

#include <numbers>
#include <stdexcept>

namespace gonio::instrument {
namespace {

void require(bool ok, const char* field, double value, const char* expected) {
  if (!ok) {
    throw std::invalid_argument(
        fmt::format("instrument: {} is {}, expected {}", field, value, expected));
  }
}

}  // namespace

void Instrument::validate() const {
  rig.validate();
  require(camera.width_px > 0 && camera.width_px <= 65536, "camera.width_px", camera.width_px,
          "1 to 65536");
  require(camera.height_px > 0 && camera.height_px <= 65536, "camera.height_px", camera.height_px,
          "1 to 65536");
  require(camera.fx_px > 0.0, "camera.fx_px", camera.fx_px, "a positive focal length");
  require(camera.fy_px > 0.0, "camera.fy_px", camera.fy_px, "a positive focal length");
  require(sensor.gain_dn_per_e > 0.0, "sensor.gain_dn_per_e", sensor.gain_dn_per_e, "above 0");
  require(sensor.read_noise_e >= 0.0, "sensor.read_noise_e", sensor.read_noise_e, "0 or more");
  require(sensor.full_well_e > 0.0, "sensor.full_well_e", sensor.full_well_e, "above 0");
  require(sensor.black_level_dn >= 0.0, "sensor.black_level_dn", sensor.black_level_dn,
          "0 or more");
  require(sensor.saturation_dn > sensor.black_level_dn, "sensor.saturation_dn",
          sensor.saturation_dn, "above the black level");
  require(sensor.dark_current_e_per_s >= 0.0, "sensor.dark_current_e_per_s",
          sensor.dark_current_e_per_s, "0 or more");
  require(sensor.prnu >= 0.0 && sensor.prnu < 1.0, "sensor.prnu", sensor.prnu, "0 to 1");
  for (int c = 0; c < 3; ++c) {
    require(white.reflectance[c] > 0.0 && white.reflectance[c] <= 1.5, "white.reflectance",
            white.reflectance[c], "above 0, at most 1.5");
  }
  for (std::size_t i = 0; i < white.angular.size(); ++i) {
    require(white.angular[i].relative > 0.0, "white.angular", white.angular[i].relative, "above 0");
    require(i == 0 || white.angular[i].theta_i_deg > white.angular[i - 1].theta_i_deg,
            "white.angular", white.angular[i].theta_i_deg, "ascending theta_i_deg");
  }
  require(white.u_relative >= 0.0, "white.u_relative", white.u_relative, "0 or more");
  require(u_normal >= Angle(), "u_normal_deg", u_normal.degrees(), "0 or more");
  require(u_lamp_relative >= 0.0, "u_lamp_relative", u_lamp_relative, "0 or more");
  require(u_linearity_relative >= 0.0, "u_linearity_relative", u_linearity_relative, "0 or more");
}

double relative_response(const Instrument& instrument, double column, double row) {
  const CameraModel& camera = instrument.camera;
  const double x = (column - camera.cx_px) / camera.fx_px;
  const double y = (row - camera.cy_px) / camera.fy_px;
  const double q = x * x + y * y;
  const Vignetting& v = instrument.vignetting;
  return 1.0 + q * (v.v1 + q * (v.v2 + q * v.v3));
}

double relative_intensity(const LampField& field, const Eigen::Vector3d& direction_in_lamp) {
  const double x = direction_in_lamp.x() / direction_in_lamp.z();
  const double y = direction_in_lamp.y() / direction_in_lamp.z();
  return 1.0 + field.c10 * x + field.c01 * y + field.c20 * x * x + field.c11 * x * y +
         field.c02 * y * y;
}

brdf::Rgb white_brdf(const WhiteReference& white, Angle theta_i) {
  double relative = 1.0;
  const auto& table = white.angular;
  if (!table.empty()) {
    const double theta = theta_i.degrees();
    std::size_t upper = 0;
    while (upper < table.size() && table[upper].theta_i_deg < theta) ++upper;
    if (upper == 0) {
      relative = table.front().relative;
    } else if (upper == table.size()) {
      relative = table.back().relative;
    } else {
      const auto& a = table[upper - 1];
      const auto& b = table[upper];
      const double t = (theta - a.theta_i_deg) / (b.theta_i_deg - a.theta_i_deg);
      relative = a.relative + t * (b.relative - a.relative);
    }
  }
  return white.reflectance * (relative * std::numbers::inv_pi);
}

}  // namespace gonio::instrument
