#include "radiance.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "gonio/brdf/diffuse_models.h"
#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"

namespace gonio::sim {
namespace {

constexpr std::size_t kKeptImages = 4;
constexpr std::size_t kRadianceRows = 8;
constexpr double kWhiteAlbedo = 0.99;
constexpr double kSquareMmPerSquareM = 1e6;

std::shared_ptr<const brdf::BrdfModel> lambertian(double albedo) {
  return std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(albedo));
}

std::shared_ptr<const brdf::BrdfModel> or_white(std::shared_ptr<const brdf::BrdfModel> model) {
  return model ? model : lambertian(kWhiteAlbedo);
}

bool in_square(double x, double y, double half_width) {
  return std::abs(x) <= half_width && std::abs(y) <= half_width;
}

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
    : options_(options),
      lens_(options.camera),
      white_tile_(or_white(options.scene.white_tile)),
      patch_(or_white(options.scene.patch)),
      holder_(lambertian(options.scene.holder_albedo)) {
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

const brdf::BrdfModel* RadianceRenderer::material_at(double x_mm, double y_mm,
                                                     devices::Target target) const {
  const SceneOptions& scene = options_.scene;
  if (target == devices::Target::sample) {
    if (in_square(x_mm, y_mm, scene.sample_half_width_mm)) return scene.sample.get();
  } else {
    if (in_square(x_mm, y_mm, scene.white_tile_half_width_mm)) return white_tile_.get();
  }
  if (scene.white_patch &&
      in_square(x_mm - scene.patch_x_mm, y_mm - scene.patch_y_mm, scene.patch_half_width_mm)) {
    return patch_.get();
  }
  return in_square(x_mm, y_mm, scene.holder_half_width_mm) ? holder_.get() : nullptr;
}

std::shared_ptr<const RadianceImage> RadianceRenderer::render_anew(const rig::Joints& joints,
                                                                   devices::Target target) const {
  const rig::RigPose pose = rig::forward(options_.rig, joints);
  const MountOptions& mount =
      target == devices::Target::sample ? options_.sample_mount : options_.white_mount;
  const Eigen::Isometry3d target_from_world = (pose.world_from_sample * mounted(mount)).inverse();
  const Eigen::Isometry3d target_from_camera = target_from_world * pose.world_from_camera;
  const Illumination illumination(pose, target_from_world, options_.lamp, lamp_distance_mm_);
  const Eigen::Vector3d eye = target_from_camera.translation();

  const auto width = static_cast<std::size_t>(options_.camera.width_px);
  const auto height = static_cast<std::size_t>(options_.camera.height_px);
  auto image = std::make_shared<RadianceImage>();
  for (auto& plane : image->planes) plane.assign(width * height, 0.0F);

  parallel::for_each_block(0, height, kRadianceRows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t pixel = begin * width; pixel < end * width; ++pixel) {
      const Eigen::Vector3d ray =
          (target_from_camera.linear() * lens_.ray(pixel).homogeneous()).normalized();
      if (eye.z() <= 0.0 || ray.z() >= 0.0) continue;  // the plane from behind or never
      const double way = -eye.z() / ray.z();
      const Eigen::Vector3d point(eye.x() + way * ray.x(), eye.y() + way * ray.y(), 0.0);
      const brdf::BrdfModel* material = material_at(point.x(), point.y(), target);
      if (material == nullptr) continue;
      const Illumination::Light light = illumination.at(point);
      if (light.irradiance <= 0.0) continue;
      const brdf::Rgb radiance =
          material->evaluate(brdf::DirectionPair{light.wi, -ray}) * light.irradiance;
      if (!(radiance >= 0.0).all() || !radiance.isFinite().all()) {
        throw NumericalError(fmt::format(
            "simulated material: found a radiance of {}, {}, {} at ({:.3f}, {:.3f}) mm, expected "
            "zero or more",
            radiance[0], radiance[1], radiance[2], point.x(), point.y()));
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
