#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "gonio/design/near_field.h"

namespace gonio::design {

/// What one pixel of a near-field shot sees.
struct NearFieldPixel {
  brdf::DirectionPair directions;
  double distance_mm;  ///< of its point from the sample's centre, along x or y, the larger
};

/// Calls use(pixel) for every pixel that sees the plane of the sample, light and view within
/// setup.theta_max, row by row; the sample's size is not asked.
template <typename Use>
void for_each_usable_pixel(const brdf::HalfDiff& centre, const NearFieldSetup& setup, Use&& use) {
  setup.validate();
  if (!brdf::above_horizon(centre.theta_h, centre.theta_d, centre.phi_d)) {
    throw std::invalid_argument("near field: a shot's centre is below the horizon");
  }
  brdf::HalfDiff nominal = centre;
  nominal.phi_h = Angle();
  const brdf::DirectionPair pair = brdf::directions_from_half_diff(nominal);
  const Eigen::Vector3d eye = setup.camera_distance_mm * pair.wo;
  // Level: in the surface's plane; any direction will do for a camera straight above.
  const Eigen::Vector3d level = Eigen::Vector3d::UnitZ().cross(pair.wo);
  const Eigen::Vector3d right =
      level.norm() > 1e-9 ? Eigen::Vector3d(level.normalized()) : Eigen::Vector3d::UnitX();
  const Eigen::Vector3d up = pair.wo.cross(right);
  const double edge = std::tan(0.5 * setup.field_of_view.radians());
  const double least_cosine = cos(setup.theta_max);
  const auto along = [&](int i) { return edge * ((2.0 * i + 1.0) / setup.image_px - 1.0); };
  for (int row = 0; row < setup.image_px; ++row) {
    for (int column = 0; column < setup.image_px; ++column) {
      const Eigen::Vector3d ray = along(column) * right - along(row) * up - pair.wo;
      if (ray.z() >= 0.0) continue;
      const Eigen::Vector3d point = eye - (eye.z() / ray.z()) * ray;
      NearFieldPixel pixel{{pair.wi, -ray.normalized()},
                           std::max(std::abs(point.x()), std::abs(point.y()))};
      if (std::isfinite(setup.lamp_distance_mm)) {
        pixel.directions.wi = (setup.lamp_distance_mm * pair.wi - point).normalized();
      }
      if (pixel.directions.wi.z() >= least_cosine && pixel.directions.wo.z() >= least_cosine) {
        use(pixel);
      }
    }
  }
}

}  // namespace gonio::design
