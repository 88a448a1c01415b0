#include "gonio/instrument/measurement_equation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gonio::instrument {

std::optional<PixelGeometry> pixel_geometry(const Instrument& instrument, const rig::RigPose& pose,
                                            double column, double row) {
  const Eigen::Isometry3d sample_from_world = pose.world_from_sample.inverse();
  const Eigen::Isometry3d sample_from_camera = sample_from_world * pose.world_from_camera;
  const Eigen::Vector3d centre = sample_from_camera.translation();
  const Eigen::Vector3d ray = sample_from_camera.linear() * instrument.camera.ray(column, row);
  if (!(centre.z() > 0.0) || !(ray.z() < 0.0)) return std::nullopt;
  PixelGeometry geometry;
  geometry.point_in_sample_mm = centre - ray * (centre.z() / ray.z());
  geometry.point_in_sample_mm.z() = 0.0;
  geometry.directions = pose.directions_at(geometry.point_in_sample_mm);
  const double cos_theta_i = geometry.directions.wi.z();
  if (!(cos_theta_i > 0.0)) return std::nullopt;

  const Eigen::Vector3d point_in_lamp =
      pose.world_from_lamp.inverse() * (pose.world_from_sample * geometry.point_in_sample_mm);
  double falloff = 1.0;
  double intensity = 1.0;
  double square_mm = 1.0;
  if (!pose.collimated_lamp) {
    if (!(point_in_lamp.z() > 0.0)) return std::nullopt;
    falloff = 1.0 / point_in_lamp.squaredNorm();
    intensity = relative_intensity(instrument.lamp_field, point_in_lamp);
    square_mm =
        (pose.world_from_lamp.translation() - pose.world_from_sample.translation()).squaredNorm();
  }
  const double response = relative_response(instrument, column, row);
  geometry.factor = response * intensity * cos_theta_i * falloff;
  geometry.stray_factor = response * std::numbers::inv_pi / square_mm;
  return geometry;
}

Angle half_vector_sigma(const Instrument& instrument, Angle theta_d) {
  // At grazing incidence of both beams h is defined by less and less.
  constexpr double kLeastCosine = 0.02;
  const double across = 1.0 / std::max(kLeastCosine, cos(theta_d));
  const double by_lamp = 0.5 * std::sqrt(0.5 * (1.0 + across * across));
  return Angle::from_radians(
      std::hypot(instrument.u_normal.radians(), by_lamp * instrument.u_lamp_direction.radians()));
}

std::optional<Eigen::Vector2d> pixel_of_point(const Instrument& instrument,
                                              const rig::RigPose& pose,
                                              const Eigen::Vector3d& point_in_sample_mm) {
  const Eigen::Vector3d point_in_camera =
      pose.world_from_camera.inverse() * (pose.world_from_sample * point_in_sample_mm);
  if (!(point_in_camera.z() > 0.0)) return std::nullopt;
  return instrument.camera.project(point_in_camera);
}

}  // namespace gonio::instrument
