#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "gonio/brdf/shading_geometry.h"

namespace gonio::render {

/// A light direction as a viewer on the z axis meets it: the half vector is the same wherever on
/// the sphere the light falls, so theta_d is too.
struct ViewedLight {
  explicit ViewedLight(const Eigen::Vector3d& light)
      : direction(light), half((light + Eigen::Vector3d::UnitZ()).normalized()) {
    half_cross_light = half.cross(light);
    cos_theta_d = std::min(light.dot(half), 1.0);
    sin_theta_d = half_cross_light.norm();
    theta_d = Angle::from_radians(std::atan2(sin_theta_d, cos_theta_d));
  }

  Eigen::Vector3d direction;
  Eigen::Vector3d half;
  Eigen::Vector3d half_cross_light;
  double cos_theta_d;
  double sin_theta_d;
  Angle theta_d;
};

/// What a BRDF needs to know about a surface element with this normal under that light. phi_h is 0.
inline brdf::ShadingGeometry geometry_at(const Eigen::Vector3d& normal, const ViewedLight& light) {
  brdf::ShadingGeometry g;
  g.cos_theta_i = normal.dot(light.direction);
  g.cos_theta_o = normal.z();
  g.cos_theta_h = std::clamp(normal.dot(light.half), 0.0, 1.0);
  g.sin_theta_h = normal.cross(light.half).norm();
  g.cos_theta_d = light.cos_theta_d;
  g.sin_theta_d = light.sin_theta_d;
  // The light's components in the plane of normal and half vector, and across it, both times
  // sin theta_h: d.((n x h) x h) = (d.h)(n.h) - d.n and d.(n x h) = n.(h x d).
  const double along = light.cos_theta_d * g.cos_theta_h - g.cos_theta_i;
  const double across = normal.dot(light.half_cross_light);
  const double length = std::sqrt(along * along + across * across);
  g.cos_phi_d = length > 0.0 ? along / length : 1.0;
  g.sin_phi_d = length > 0.0 ? across / length : 0.0;
  g.half_diff.theta_h = Angle::from_radians(std::atan2(g.sin_theta_h, g.cos_theta_h));
  g.half_diff.theta_d = light.theta_d;
  g.half_diff.phi_d = Angle::from_radians(std::atan2(across, along));
  return g;
}

}  // namespace gonio::render
