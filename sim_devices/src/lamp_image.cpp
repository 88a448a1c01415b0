#include "lamp_image.h"

#include <cmath>
#include <numbers>

namespace gonio::sim {
namespace {

constexpr double kSquareMmPerSquareMetre = 1e6;
// Light along the normal has no plane of incidence: both polarisations reflect alike.
constexpr double kNormalIncidence = 1e-9;

Eigen::Vector3d across(const Eigen::Isometry3d& target_from_device, Angle direction) {
  return target_from_device.linear() * Eigen::Vector3d(cos(direction), sin(direction), 0.0);
}

struct Fresnel {
  double s;
  double p;
};

/// Born and Wolf, Principles of Optics, 1.5.2, for a dielectric in air.
Fresnel fresnel_reflectances(double cos_i, double index) {
  const double sin_t = std::sqrt(std::max(0.0, 1.0 - cos_i * cos_i)) / index;
  const double cos_t = std::sqrt(std::max(0.0, 1.0 - sin_t * sin_t));
  const double s = (cos_i - index * cos_t) / (cos_i + index * cos_t);
  const double p = (index * cos_i - cos_t) / (index * cos_i + cos_t);
  return {s * s, p * p};
}

}  // namespace

LampImage::LampImage(const rig::RigPose& pose, const Eigen::Isometry3d& target_from_world,
                     const LampOptions& lamp, const CameraOptions& camera)
    : lamp_((target_from_world * pose.world_from_lamp).translation()),
      into_lamp_((target_from_world * pose.world_from_lamp).linear().transpose()),
      lamp_polarisation_(
          across(target_from_world * pose.world_from_lamp, lamp.polarisation_direction)),
      camera_polarisation_(
          across(target_from_world * pose.world_from_camera, camera.polarisation_direction)),
      lamp_degree_(lamp.polarisation),
      camera_degree_(camera.polarisation),
      radius_mm_(lamp.radius_mm),
      radiance_(kSquareMmPerSquareMetre / (std::numbers::pi * lamp.radius_mm * lamp.radius_mm)) {}

bool LampImage::seen(const Eigen::Vector3d& point, const Eigen::Vector3d& ray) const {
  const Eigen::Vector3d from = into_lamp_ * (point - lamp_);
  const Eigen::Vector3d along = into_lamp_ * Eigen::Vector3d(ray.x(), ray.y(), -ray.z());
  if (!(along.z() < 0.0) || !(from.z() > 0.0)) return false;  // the lamp's back
  const Eigen::Vector3d hit = from - along * (from.z() / along.z());
  return hit.head<2>().squaredNorm() <= radius_mm_ * radius_mm_;
}

double LampImage::reflected(const Eigen::Vector3d& point, const Eigen::Vector3d& ray,
                            const PolishedOptions& polish, bool fresnel) const {
  if (!seen(point, ray)) return 0.0;
  const Eigen::Vector3d mirrored(ray.x(), ray.y(), -ray.z());
  if (!fresnel) return polish.reflectance;

  const double cos_i = mirrored.z();
  const Fresnel r = fresnel_reflectances(cos_i, polish.refractive_index);
  const Eigen::Vector3d s_axis(-mirrored.y(), mirrored.x(), 0.0);  // normal x ray
  const double length = s_axis.norm();
  if (length < kNormalIncidence) return 0.5 * (r.s + r.p);
  // Malus: shares of source and camera along s, each projected across its own ray by being unit.
  const auto share_s = [&](const Eigen::Vector3d& axis, const Eigen::Vector3d& beam,
                           double degree) {
    const Eigen::Vector3d in_front = (axis - axis.dot(beam) * beam).normalized();
    const double cosine = in_front.dot(s_axis) / length;
    return 0.5 * (1.0 - degree) + degree * cosine * cosine;
  };
  const double source_s = share_s(lamp_polarisation_, mirrored, lamp_degree_);
  const double camera_s = share_s(camera_polarisation_, ray, camera_degree_);
  return 2.0 * (r.s * source_s * camera_s + r.p * (1.0 - source_s) * (1.0 - camera_s));
}

}  // namespace gonio::sim
