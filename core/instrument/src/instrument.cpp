#include "gonio/instrument/instrument.h"

#include <fmt/format.h>

#include <stdexcept>

#include "angular_table.h"

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
  require_table(white.angular);
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

}  // namespace gonio::instrument
