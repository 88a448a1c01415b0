#include "radiance.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>

#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"
#include "lamp_image.h"

namespace gonio::sim {
namespace {

constexpr std::size_t kKeptImages = 4;
constexpr std::size_t kRadianceRows = 8;
// A place in which something else begins is the mean of some rays, which lie on a Fibonacci lattice
// (Sloan, Joe, Lattice Methods for Multiple Integration, 1994): no two share a column or a row, so
// that 34 of them place an edge along either to 1/34 px; a square grid of as many, to 1/6 px.
struct RayLattice {
  int rays;
  int step;
};
constexpr RayLattice kInPixel{34, 21};
constexpr RayLattice kInQuarter{13, 8};
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
      : Illumination(target_from_world * pose.world_from_lamp, lamp, pose.collimated_lamp,
                     lamp_distance_mm) {}

  struct Light {
    Eigen::Vector3d wi;
    double irradiance;  ///< W m^-2; 0 when the light comes from below
  };

  Light at(const Eigen::Vector3d& point) const {
    const Eigen::Vector3d in_lamp = into_lamp_ * (point - lamp_);
    if (in_lamp.z() <= 0.0) return {Eigen::Vector3d::UnitZ(), 0.0};
    Light light;
    double square_mm = lamp_distance_mm_ * lamp_distance_mm_;
    if (collimated_) {
      light.wi = -into_lamp_.row(2);
    } else {
      const Eigen::Vector3d to_lamp = lamp_ - point;
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
  Illumination(const Eigen::Isometry3d& target_from_lamp, const LampOptions& lamp, bool collimated,
               double lamp_distance_mm)
      : lamp_(target_from_lamp.translation()),
        into_lamp_(target_from_lamp.linear().transpose()),
        field_(lamp.field),
        collimated_(collimated),
        lamp_distance_mm_(lamp_distance_mm) {}

  Eigen::Vector3d lamp_;       ///< its place in the target's frame
  Eigen::Matrix3d into_lamp_;  ///< turns the target's axes into the lamp's
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

  /// What lies along a ray: two rays that differ in it have an edge between them.
  struct Kind {
    const brdf::BrdfModel* material;
    double reflected;
    bool operator==(const Kind&) const = default;
  };
  /// Radiance along (x, y, 1) of the camera's frame, per 1 W/sr in each band. Says what kind of
  /// place it is when asked.
  brdf::Rgb along(const Eigen::Vector2d& ideal, Kind* kind = nullptr) const {
    const Seen seen = seen_along(ideal);
    if (kind != nullptr) *kind = {seen.material, seen.reflected};
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
      seen.reflected =
          polish->filter * lamp_image_.reflected(seen.point, seen.ray, *polish,
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

/// 1 where an edge crosses a pixel: it is of another kind than one of its eight neighbours.
std::vector<std::uint8_t> edges_of(const std::vector<PixelView::Kind>& kinds, std::size_t width) {
  std::vector<std::uint8_t> edges(kinds.size());
  const auto compare = [&](std::size_t one, std::size_t other) {
    const std::uint8_t differ = kinds[one] == kinds[other] ? 0 : 1;
    edges[one] |= differ;
    edges[other] |= differ;
  };
  for (std::size_t row = 0; row * width < kinds.size(); ++row) {
    const std::size_t first = row * width;
    for (std::size_t pixel = first; pixel + 1 < first + width; ++pixel) compare(pixel, pixel + 1);
    if (first + width == kinds.size()) break;
    for (std::size_t pixel = first; pixel < first + width; ++pixel) {
      compare(pixel, pixel + width);
      if (pixel > first) compare(pixel, pixel + width - 1);
      if (pixel + 1 < first + width) compare(pixel, pixel + width + 1);
    }
  }
  return edges;
}

/// Convolves with a Gaussian, edges repeated. Tap by tap along whole rows, which compilers turn
/// into vectors.
void blur(std::vector<float>& plane, int width, int height, double sigma_px) {
  const int radius = static_cast<int>(std::ceil(4.0 * sigma_px));
  std::vector<float> kernel;
  double sum = 0.0;
  for (int offset = -radius; offset <= radius; ++offset) {
    sum += std::exp(-0.5 * offset * offset / (sigma_px * sigma_px));
  }
  for (int offset = -radius; offset <= radius; ++offset) {
    kernel.push_back(
        static_cast<float>(std::exp(-0.5 * offset * offset / (sigma_px * sigma_px)) / sum));
  }
  const auto columns = static_cast<std::size_t>(width);
  const auto rows = static_cast<std::size_t>(height);
  const auto taps = kernel.size();
  std::vector<float> across(plane.size());
  parallel::for_each_block(0, rows, kRadianceRows, [&](std::size_t begin, std::size_t end) {
    std::vector<float> padded(columns + taps - 1);
    for (std::size_t row = begin; row < end; ++row) {
      const float* const from = plane.data() + row * columns;
      float* const to = across.data() + row * columns;
      for (std::size_t i = 0; i < padded.size(); ++i) {
        padded[i] = from[std::clamp(static_cast<int>(i) - radius, 0, width - 1)];
      }
      std::fill_n(to, columns, 0.0F);
      for (std::size_t tap = 0; tap < taps; ++tap) {
        const float weight = kernel[tap];
        const float* const shifted = padded.data() + tap;
        for (std::size_t column = 0; column < columns; ++column) {
          to[column] += weight * shifted[column];
        }
      }
    }
  });
  parallel::for_each_block(0, rows, kRadianceRows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      float* const to = plane.data() + row * columns;
      std::fill_n(to, columns, 0.0F);
      for (std::size_t tap = 0; tap < taps; ++tap) {
        const int source = std::clamp(static_cast<int>(row + tap) - radius, 0, height - 1);
        const float weight = kernel[tap];
        const float* const from = across.data() + static_cast<std::size_t>(source) * columns;
        for (std::size_t column = 0; column < columns; ++column)
          to[column] += weight * from[column];
      }
    }
  });
}

/// Pixels of `parts` x `parts` places each.
std::vector<float> mean_of_parts(const std::vector<float>& plane, std::size_t width,
                                 std::size_t height, std::size_t parts) {
  std::vector<float> means(plane.size() / (parts * parts));
  const auto share = 1.0F / static_cast<float>(parts * parts);
  for (std::size_t row = 0; row < height; ++row) {
    float* const to = means.data() + row / parts * (width / parts);
    const float* const from = plane.data() + row * width;
    for (std::size_t column = 0; column < width; ++column) {
      to[column / parts] += share * from[column];
    }
  }
  return means;
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

MountOptions RadianceRenderer::mount_of(devices::Target target) const {
  if (target == devices::Target::sample) return options_.sample_mount;
  if (target == devices::Target::white) return options_.white_mount;
  using devices::Target;
  const bool turned = target == Target::mirror_turned || target == Target::board_turned;
  const auto found = options_.mounts.find(target == Target::mirror_turned  ? Target::mirror
                                          : target == Target::board_turned ? Target::board
                                                                           : target);
  MountOptions mount = found == options_.mounts.end() ? MountOptions{} : found->second;
  if (turned) {
    mount.tilt_about_x = -mount.tilt_about_x;
    mount.tilt_about_y = -mount.tilt_about_y;
  }
  return mount;
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

  // One ray a pixel for plain targets; printed and polished ones have edges that matter. A lens
  // blurs before a sensor samples: prints, in which corners are looked for to a hundredth of a
  // pixel, are blurred in quarters of pixels. In whole ones, corners were 0.02 px off, alike for
  // all edges along the columns.
  const bool fine = target != devices::Target::sample && target != devices::Target::white &&
                    target != devices::Target::black_trap;
  const bool printed = target == devices::Target::board || target == devices::Target::board_turned;
  const std::size_t parts = printed ? 2 : 1;  // of a pixel's edge
  const RayLattice lattice = printed ? kInQuarter : kInPixel;
  const auto width = static_cast<std::size_t>(options_.camera.width_px) * parts;
  const auto height = static_cast<std::size_t>(options_.camera.height_px) * parts;
  const auto part = 1.0 / static_cast<double>(parts);
  /// Ray of the place at (x, y) of a part of a pixel, in parts from its middle.
  const auto ray = [&](std::size_t row, std::size_t column, double x, double y) {
    const double right = (static_cast<double>(column % parts) + 0.5 + x) * part - 0.5;
    const double down = (static_cast<double>(row % parts) + 0.5 + y) * part - 0.5;
    return lens_.ray_in(row / parts, column / parts, right, down);
  };

  auto image = std::make_shared<RadianceImage>();
  for (auto& plane : image->planes) plane.assign(width * height, 0.0F);
  const auto keep = [&](std::size_t place, const brdf::Rgb& radiance) {
    for (int band = 0; band < 3; ++band) {
      image->planes[band][place] = static_cast<float>(radiance[band]);
    }
  };
  std::vector<PixelView::Kind> kinds(fine ? width * height : 0);
  parallel::for_each_block(0, height, kRadianceRows, [&](std::size_t begin, std::size_t end) {
    for (std::size_t row = begin; row < end; ++row) {
      for (std::size_t column = 0; column < width; ++column) {
        const std::size_t place = row * width + column;
        keep(place, view.along(ray(row, column, 0.0, 0.0), fine ? &kinds[place] : nullptr));
      }
    }
  });
  const std::vector<std::uint8_t> edges = edges_of(kinds, width);
  parallel::for_each_block(
      0, fine ? height : 0, kRadianceRows, [&](std::size_t begin, std::size_t end) {
        for (std::size_t row = begin; row < end; ++row) {
          for (std::size_t column = 0; column < width; ++column) {
            if (edges[row * width + column] == 0) continue;
            brdf::Rgb radiance = brdf::Rgb::Zero();
            for (int i = 0; i < lattice.rays; ++i) {
              const double x = (i + 0.5) / lattice.rays - 0.5;
              const double y = (i * lattice.step % lattice.rays + 0.5) / lattice.rays - 0.5;
              radiance += view.along(ray(row, column, x, y)) / lattice.rays;
            }
            keep(row * width + column, radiance);
          }
        }
      });

  // What is grey, as most targets of a calibration are, is worked on once.
  auto& [red, green, blue] = image->planes;
  const std::array<bool, 3> is_red{false, green == red, blue == red};
  for (std::size_t band = 0; band < 3; ++band) {
    auto& plane = image->planes[band];
    if (is_red[band]) {
      plane = red;
      continue;
    }
    if (options_.camera.psf_sigma_px > 0.0) {
      blur(plane, static_cast<int>(width), static_cast<int>(height),
           static_cast<double>(parts) * options_.camera.psf_sigma_px);
    }
    if (parts > 1) plane = mean_of_parts(plane, width, height, parts);
  }
  return image;
}

}  // namespace gonio::sim
