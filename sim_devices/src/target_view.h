#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "gonio/devices/target_changer.h"
#include "illumination.h"
#include "lamp_image.h"
#include "scene.h"

namespace gonio::sim {

/// What the camera sees of a target along rays, in one pose. Directions are in the target's frame,
/// of any length, away from the camera; places are points of the target's plane, mm.
///
/// Threads  const, may be shared.
class TargetView {
 public:
  /// `scene` must outlive it.
  TargetView(const Scene& scene, devices::Target target,
             const Eigen::Isometry3d& target_from_camera, const Illumination& illumination,
             const LampImage& lamp_image);

  /// What lies along a ray: between two rays that differ in it there is an edge.
  struct Kind {
    std::uint16_t surface = 0;
    bool shines = false;  ///< with the lamp's image
    bool operator==(const Kind&) const = default;
  };
  /// Both infinite where the ray misses the plane's face.
  struct Place {
    double x_mm;
    double y_mm;
  };
  /// Of a ray, which is (x, y) of (x, y, 1) in the camera's frame.
  Eigen::Vector3d direction(const Eigen::Vector2d& ray) const {
    return from_camera_.col(0) * ray.x() + from_camera_.col(1) * ray.y() + from_camera_.col(2);
  }
  Place place_along(const Eigen::Vector3d& direction) const {
    if (eye_.z() <= 0.0 || direction.z() >= 0.0) return {kMissed, kMissed};  // from behind or never
    const double way = -eye_.z() / direction.z();
    return {eye_.x() + way * direction.x(), eye_.y() + way * direction.y()};
  }
  Kind kind_at(const Place& place, const Eigen::Vector3d& direction) const;

  /// Radiance per 1 W/sr in each band, W m^-2 sr^-1. Throws NumericalError where a material gives
  /// what is none.
  brdf::Rgb radiance_at(const Place& place, const Eigen::Vector3d& direction) const;

  /// Where `count` rays, (x, y) of (x, y, 1) in the camera's frame, meet the plane, and the light
  /// there: 0 W m^-2 where they miss it.
  struct Rays {
    const double* x;
    const double* y;
    std::size_t count;
  };
  struct Places {
    double* x_mm;
    double* y_mm;
    float* irradiance;
  };
  void places_along(const Rays& rays, const Places& places) const;

  const Scene& scene() const { return scene_; }

 private:
  static constexpr double kMissed = std::numeric_limits<double>::infinity();

  const Scene& scene_;
  devices::Target target_;
  Eigen::Matrix3d from_camera_;
  Eigen::Vector3d eye_;
  Illumination illumination_;
  LampImage lamp_image_;
};

}  // namespace gonio::sim
