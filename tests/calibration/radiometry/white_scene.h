#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "example_instrument.h"
#include "gonio/calibration/radiometry/white_view.h"
#include "gonio/random/stream.h"

namespace gonio::calibration {

/// A rig whose axes are off, with a lamp and a lens that fall off.
inline instrument::Instrument true_instrument() {
  instrument::Instrument instrument = instrument::example_instrument();
  instrument.lamp_field = {.c10 = 0.05, .c01 = -0.03, .c20 = -1.8, .c11 = 0.4, .c02 = -2.2};
  instrument.vignetting = {.v1 = -1.9, .v2 = 3.0, .v3 = 0.0};
  // Two functions of theta_i, joined over theta_o: one at 0, the other at 90 deg.
  instrument.white.angular = {{0.0, 30.0, 60.0, 80.0},
                              {0.0, 90.0},
                              {0.0},
                              {1.0, 1.0, 1.004, 0.994, 0.985, 0.975, 0.95, 0.94}};
  return instrument;
}

inline rig::Joints joints_deg(double lamp_arm, double azimuth, double tilt) {
  return {Angle::from_degrees(lamp_arm), Angle::from_degrees(azimuth), Angle::from_degrees(tilt)};
}

constexpr std::array<double, 3> kConstant{2.0e9, 3.0e9, 1.5e9};

/// What a camera sees of the white, by formulas of its own: vectors, no pixel_geometry().
inline WhiteView seen_white(const instrument::Instrument& truth, const rig::Joints& joints,
                            int channel, double relative_noise, random::Stream& noise,
                            double monitor = 1.0) {
  const rig::RigPose pose = rig::forward(truth.rig, joints);
  const Eigen::Vector3d normal = pose.world_from_sample.linear().col(2);
  const Eigen::Vector3d origin = pose.world_from_sample.translation();
  const Eigen::Vector3d eye = pose.world_from_camera.translation();
  const Eigen::Vector3d lamp = pose.world_from_lamp.translation();
  WhiteView view{joints, channel, monitor, {}};
  for (double row = 12.0; row < 256.0; row += 33.0) {
    for (double column = 10.0; column < 320.0; column += 37.5) {
      const Eigen::Vector3d ray = pose.world_from_camera.linear() * truth.camera.ray(column, row);
      const Eigen::Vector3d point = eye + ray * (normal.dot(origin - eye) / normal.dot(ray));
      const Eigen::Vector3d to_lamp = lamp - point;
      const double cosine = normal.dot(to_lamp.normalized());
      const Eigen::Vector3d beam = pose.world_from_lamp.linear().transpose() * -to_lamp;
      const double x = beam.x() / beam.z();
      const double y = beam.y() / beam.z();
      const auto& c = truth.lamp_field;
      const double field =
          1.0 + c.c10 * x + c.c01 * y + c.c20 * x * x + c.c11 * x * y + c.c02 * y * y;
      const double q =
          (std::pow(column - truth.camera.cx_px, 2) + std::pow(row - truth.camera.cy_px, 2)) /
          std::pow(truth.camera.fx_px, 2);
      const double lens = 1.0 + truth.vignetting.v1 * q + truth.vignetting.v2 * q * q;
      const double theta_deg = std::acos(cosine) * 180.0 / std::numbers::pi;
      const double seen_deg = std::acos(-normal.dot(ray.normalized())) * 180.0 / std::numbers::pi;
      const double factor = (theta_deg < 30.0   ? 1.0 + 0.004 * theta_deg / 30.0
                             : theta_deg < 60.0 ? 1.004 - 0.019 * (theta_deg - 30.0) / 30.0
                                                : 0.985 - 0.035 * (theta_deg - 60.0) / 20.0) -
                            0.01 * seen_deg / 90.0 * std::min(1.0, theta_deg / 30.0);
      const double white = truth.white.reflectance[channel] * factor / std::numbers::pi;
      const double signal = kConstant[static_cast<std::size_t>(channel)] * monitor * white * field *
                            lens * cosine / to_lamp.squaredNorm();
      view.pixels.push_back(
          {column, row, signal * (1.0 + relative_noise * noise.normal()), signal * relative_noise});
    }
  }
  return view;
}

}  // namespace gonio::calibration
