#include "radiance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"
#include "lamp_image.h"

namespace gonio::sim {
namespace {

constexpr std::size_t kKeptImages = 4;
constexpr std::size_t kRadianceRows = 8;
// A pixel in which something else begins is the mean of so many rays, which lie on a Fibonacci
// lattice (Sloan, Joe, Lattice Methods for Multiple Integration, 1994): no two share a column or a
// row, so that an edge along either is placed to 1/34 px; a square grid of as many places it to
// 1/6 px.
constexpr int kRays = 34;
constexpr int kRayStep = 21;
constexpr double kSquareMmPerSquareM = 1e6;

Eigen::Isometry3d mounted(const MountOptions& mount) {
  Eigen::Isometry3d holder_from_target = Eigen::Isometry3d::Identity();
  holder_from_target.rotate(
      Eigen::AngleAxisd(mount.tilt_about_x.radians(), Eigen::Vector3d::UnitX()));
  holder_from_target.rotate(
      Eigen::AngleAxisd(mount.tilt_about_y.radians(), Eigen::Vector3d::UnitY()));
  holder_from_target.translate(Eigen::Vector3d(0.0, 0.0, mount.height_mm));
  return holder_from_target;
}

/// Light at points of the target's plane: direction to the lamp and irradiance per 1 W/sr.
class Illumination {
 public:
  Illumination(const rig::RigPose& pose, const Eigen::Isometry3d& target_from_world,
               const LampOptions& lamp, double lamp_distance_mm)
      : target_from_lamp_(target_from_world * pose.world_from_lamp),
        lamp_from_target_(target_from_lamp_.inverse()),
        field_(lamp.field),
        collimated_(pose.collimated_lamp),
        lamp_distance_mm_(lamp_distance_mm) {}

  struct Light {
    Eigen::Vector3d wi;
    double irradiance;  ///< W m^-2; 0 when the light comes from below
  };

  Light at(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d in_lamp = lamp_from_target_ * point;
    if (in_lamp.z() <= 0.0) return {Eigen::Vector3d::UnitZ(), 0.0};
    Light light;
    double square_mm = lamp_distance_mm_ * lamp_distance_mm_;
    if (collimated_) {
      light.wi = -target_from_lamp_.linear().col(2);
    } else {
      const Eigen::Vector3d to_lamp = target_from_lamp_.translation() - point;
      square_mm = to_lamp.squaredNorm();
      light.wi = to_lamp / std::sqrt(square_mm);
    }
    // A collimated beam's profile goes by place, measured as the angle it has at the rig's centre.
    const double depth = collimated_ ? lamp_distance_mm_ : in_lamp.z();
    const double x = in_lamp.x() / depth;
    const double y = in_lamp.y() / depth;
    const double field = 1.0 + field_[0] * x + field_[1] * y + field_[2] * x * x +
                         field_[3] * x * y + field_[4] * y * y;
    light.irradiance =
        std::max(0.0, field) * std::max(0.0, light.wi.z()) * kSquareMmPerSquareM / square_mm;
    return light;
  }

 private:
  Eigen::Isometry3d target_from_lamp_;
  Eigen::Isometry3d lamp_from_target_;
  std::array<double, 5> field_;
  bool collimated_;
  double lamp_distance_mm_;
};

/// What the camera sees along rays of one pose.
class PixelView {
 public:
  PixelView(const Scene& scene, devices::Target target, const Eigen::Isometry3d& target_from_camera,
            const Illumination& illumination, const LampImage& lamp_image)
      : scene_(scene),
        target_(target),
        from_camera_(target_from_camera.linear()),
        eye_(target_from_camera.translation()),
        illumination_(illumination),
        lamp_image_(lamp_image) {}

  /// Whether the corners of a pixel show something else than its centre.
  bool changes_within(const Eigen::Vector2d& centre, const Eigen::Vector2d& across,
                      const Eigen::Vector2d& down) const {
    const Seen middle = seen_along(centre);
    for (const double x : {-0.5, 0.5}) {
      for (const double y : {-0.5, 0.5}) {
        const Seen corner = seen_along(centre + x * across + y * down);
        if (corner.material != middle.material || corner.reflected != middle.reflected) return true;
      }
    }
    return false;
  }

  /// Radiance along (x, y, 1) of the camera's frame, per 1 W/sr in each band.
  brdf::Rgb along(const Eigen::Vector2d& ideal) const {
    const Seen seen = seen_along(ideal);
    if (seen.material == nullptr) return brdf::Rgb::Zero();
    brdf::Rgb radiance = brdf::Rgb::Constant(seen.reflected * lamp_image_.radiance());
    const Illumination::Light light = illumination_.at(seen.point);
    if (light.irradiance > 0.0) {
      radiance +=
          seen.material->evaluate(brdf::DirectionPair{light.wi, -seen.ray}) * light.irradiance;
    }
    if (!(radiance >= 0.0).all() || !radiance.isFinite().all()) {
      throw NumericalError(fmt::format(
          "simulated material: found a radiance of {}, {}, {} at ({:.3f}, {:.3f}) mm, expected "
          "zero or more",
          radiance[0], radiance[1], radiance[2], seen.point.x(), seen.point.y()));
    }
    return radiance;
  }

 private:
  struct Seen {
    const brdf::BrdfModel* material = nullptr;  ///< null: the background
    double reflected = 0.0;                     ///< share of the lamp's radiance
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Vector3d ray = Eigen::Vector3d::Zero();
  };

  Seen seen_along(const Eigen::Vector2d& ideal) const {
    Seen seen;
    seen.ray = (from_camera_ * ideal.homogeneous()).normalized();
    if (eye_.z() <= 0.0 || seen.ray.z() >= 0.0) return seen;  // the plane from behind or never
    const double way = -eye_.z() / seen.ray.z();
    seen.point = {eye_.x() + way * seen.ray.x(), eye_.y() + way * seen.ray.y(), 0.0};
    seen.material = scene_.material_at(seen.point.x(), seen.point.y(), target_);
    if (const PolishedOptions* polish = scene_.polish_at(seen.point.x(), seen.point.y(), target_)) {
      seen.reflected = lamp_image_.reflected(seen.point, seen.ray, *polish,
                                             target_ == devices::Target::black_glass);
    }
    return seen;
  }

  const Scene& scene_;
  devices::Target target_;
  Eigen::Matrix3d from_camera_;
  Eigen::Vector3d eye_;
  const Illumination& illumination_;
  const LampImage& lamp_image_;
};

/// Convolves with a Gaussian, edges repeated.
void blur(std::vector<float>& plane, int width, int height, double sigma_px) {
  const int radius = static_cast<int>(std::ceil(4.0 * sigma_px));
  std::vector<double> kernel;
  double sum = 0.0;
  for (int offset = -radius; offset <= radius; ++offset) {
    kernel.push_back(std::exp(-0.5 * offset * offset / (sigma_px * sigma_px)));
    sum += kernel.back();
  }
  for (double& weight : kernel) weight /= sum;

  const auto pass = [&](int dx, int dy) {
    const std::vector<float> source = plane;
    parallel::for_each_block(
        0, static_cast<std::size_t>(height), kRadianceRows,
        [&](std::size_t begin, std::size_t end) {
          for (int row = static_cast<int>(begin); row < static_cast<int>(end); ++row) {
            for (int column = 0; column < width; ++column) {
              double value = 0.0;
              for (int offset = -radius; offset <= radius; ++offset) {
                const int x = std::clamp(column + dx * offset, 0, width - 1);
                const int y = std::clamp(row + dy * offset, 0, height - 1);
                value += kernel[static_cast<std::size_t>(offset + radius)] *
                         source[static_cast<std::size_t>(y * width + x)];
              }
              plane[static_cast<std::size_t>(row * width + column)] = static_cast<float>(value);
            }
          }
        });
  };
  pass(1, 0);
  pass(0, 1);
}

}  // namespace

RadianceRenderer::RadianceRenderer(const SimOptions& options)
    : options_(options), lens_(options.camera), scene_(options.scene) {
  rig::Joints home;
  for (const rig::Axis& axis : options_.rig.axes) home.push_back(axis.home);
  const rig::RigPose pose = rig::forward(options_.rig, home);
  lamp_distance_mm_ =
      (pose.world_from_lamp.translation() - pose.world_from_sample.translation()).norm();
  if (!(lamp_distance_mm_ > 0.0)) {
    throw std::invalid_argument("rig.lamp: found the lamp in the sample, expected it in front");
  }
  white_radiance_ =
      std::numbers::inv_pi * kSquareMmPerSquareM / (lamp_distance_mm_ * lamp_distance_mm_);
}

std::shared_ptr<const RadianceImage> RadianceRenderer::render(const rig::Joints& joints,
                                                              devices::Target target) {
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Entry& entry) {
    return entry.target == target && entry.joints == joints;
  });
  if (found != kept_.end()) return found->image;
  auto image = render_anew(joints, target);
  if (kept_.size() == kKeptImages) kept_.erase(kept_.begin());
  kept_.push_back({joints, target, image});
  return image;
}

const MountOptions& RadianceRenderer::mount_of(devices::Target target) const {
  static const MountOptions flat;
  if (target == devices::Target::sample) return options_.sample_mount;
  if (target == devices::Target::white) return options_.white_mount;
  const auto found = options_.mounts.find(target);
  return found == options_.mounts.end() ? flat : found->second;
}

std::shared_ptr<const RadianceImage> RadianceRenderer::render_anew(const rig::Joints& joints,
                                                                   devices::Target target) const {
  const rig::RigPose pose = rig::forward(options_.rig, joints);
  const Eigen::Isometry3d target_from_world =
      (pose.world_from_sample * mounted(mount_of(target))).inverse();
  const Eigen::Isometry3d target_from_camera = target_from_world * pose.world_from_camera;
  const Illumination illumination(pose, target_from_world, options_.lamp, lamp_distance_mm_);
  const LampImage lamp_image(pose, target_from_world, options_.lamp, options_.camera);
  const PixelView view(scene_, target, target_from_camera, illumination, lamp_image);

  const auto width = static_cast<std::size_t>(options_.camera.width_px);
  const auto height = static_cast<std::size_t>(options_.camera.height_px);
  auto image = std::make_shared<RadianceImage>();
  for (auto& plane : image->planes) plane.assign(width * height, 0.0F);
  // One ray a pixel for plain targets; printed and polished ones have edges that matter.
  const bool fine = target != devices::Target::sample && target != devices::Target::white &&
                    target != devices::Target::black_trap;
  const Eigen::Vector2d across(1.0 / options_.camera.fx_px, 0.0);
  const Eigen::Vector2d down(0.0, 1.0 / options_.camera.fy_px);

  parallel::for_each_block(0, height, kRadianceRows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin * width; pixel < end * width; ++pixel) {
      const Eigen::Vector2d& centre = lens_.ray(pixel);
      brdf::Rgb radiance = brdf::Rgb::Zero();
      if (fine && view.changes_within(centre, across, down)) {
        for (int i = 0; i < kRays; ++i) {
          const double x = (i + 0.5) / kRays - 0.5;
          const double y = (i * kRayStep % kRays + 0.5) / kRays - 0.5;
          radiance += view.along(centre + x * across + y * down) / kRays;
        }
      } else {
        radiance = view.along(centre);
      }
      for (int band = 0; band < 3; ++band) {
        image->planes[band][pixel] = static_cast<float>(radiance[band]);
      }
    }
  });

  if (options_.camera.psf_sigma_px > 0.0) {
    for (auto& plane : image->planes) {
      blur(plane, options_.camera.width_px, options_.camera.height_px,
           options_.camera.psf_sigma_px);
    }
  }
  return image;
}

}  // namespace gonio::sim
