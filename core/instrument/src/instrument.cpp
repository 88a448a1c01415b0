#include "gonio/instrument/instrument.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <utility>

#include "angular_table.h"

namespace gonio::instrument {
namespace {

bool inside(const PixelPlace& pixel, int width_px, int height_px) {
  return pixel.column >= 0 && pixel.row >= 0 && pixel.column < width_px && pixel.row < height_px;
}

void require(bool ok, const char* field, double value, const char* expected) {
  if (!ok) {
    throw std::invalid_argument(
        fmt::format("instrument: {} is {}, expected {}", field, value, expected));
  }
}

/// A curve within these rises from black to saturation and beyond: its slope stays above 0.4.
constexpr double kMostBend = 0.1;
constexpr double kLeastScale = 0.9;  ///< of the range from black to saturation
constexpr double kLongestShutterOffset_s = 1e-3;
constexpr double kMostStray = 0.1;
constexpr double kMostBadPixels = 0.01;  ///< of all

void require_response(const SensorModel& sensor) {
  const ResponseCurve& curve = sensor.response;
  for (const auto& [field, value] :
       {std::pair{"sensor.response.c1", curve.c1}, std::pair{"sensor.response.c2", curve.c2}}) {
    require(std::abs(value) <= kMostBend, field, value, "-0.1 to 0.1");
  }
  require(curve.scale_dn > 0.0, "sensor.response.scale_dn", curve.scale_dn, "above 0");
  const bool straight = curve.c1 == 0.0 && curve.c2 == 0.0;
  const double range_dn = sensor.saturation_dn - sensor.black_level_dn;
  require(straight || curve.scale_dn >= kLeastScale * range_dn, "sensor.response.scale_dn",
          curve.scale_dn, "at least 0.9 of saturation_dn - black_level_dn");
  require(std::abs(sensor.shutter_offset_s) <= kLongestShutterOffset_s, "sensor.shutter_offset_s",
          sensor.shutter_offset_s, "-0.001 to 0.001");
}

void require_bad_pixels(const SensorModel& sensor, const CameraModel& camera) {
  const auto count = static_cast<double>(sensor.bad_pixels.size());
  require(count <= kMostBadPixels * camera.width_px * camera.height_px, "sensor.bad_pixels", count,
          "at most 1 % of the pixels");
  for (const PixelPlace& pixel : sensor.bad_pixels) {
    if (!inside(pixel, camera.width_px, camera.height_px)) {
      throw std::invalid_argument(
          fmt::format("instrument: sensor.bad_pixels has [{}, {}], expected [column, row] within "
                      "{} x {} px",
                      pixel.column, pixel.row, camera.width_px, camera.height_px));
    }
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
  require_response(sensor);
  require_bad_pixels(sensor, camera);
  for (int c = 0; c < 3; ++c) {
    require(white.reflectance[c] > 0.0 && white.reflectance[c] <= 1.5, "white.reflectance",
            white.reflectance[c], "above 0, at most 1.5");
  }
  require(stray.fraction >= 0.0 && stray.fraction <= kMostStray, "stray.fraction", stray.fraction,
          "0 to 0.1");
  require(stray.u_fraction >= 0.0 && stray.u_fraction <= kMostStray, "stray.u_fraction",
          stray.u_fraction, "0 to 0.1");
  require_table(white.angular);
  require(white.u_relative >= 0.0, "white.u_relative", white.u_relative, "0 or more");
  require(u_normal >= Angle(), "u_normal_deg", u_normal.degrees(), "0 or more");
  require(u_lamp_direction >= Angle(), "u_lamp_direction_deg", u_lamp_direction.degrees(),
          "0 or more");
  require(u_joint >= Angle(), "u_joint_deg", u_joint.degrees(), "0 or more");
  require(u_lamp_relative >= 0.0, "u_lamp_relative", u_lamp_relative, "0 or more");
  require(u_linearity_relative >= 0.0, "u_linearity_relative", u_linearity_relative, "0 or more");
}

std::vector<std::uint8_t> bad_pixel_mask(const SensorModel& sensor, int width_px, int height_px) {
  std::vector<std::uint8_t> mask(
      static_cast<std::size_t>(width_px) * static_cast<std::size_t>(height_px), 0);
  for (const PixelPlace& pixel : sensor.bad_pixels) {
    if (!inside(pixel, width_px, height_px)) {
      throw std::invalid_argument(
          fmt::format("bad pixel [{}, {}] lies outside a frame of {} x {} px", pixel.column,
                      pixel.row, width_px, height_px));
    }
    mask[static_cast<std::size_t>(pixel.row) * static_cast<std::size_t>(width_px) +
         static_cast<std::size_t>(pixel.column)] = 1;
  }
  return mask;
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
