#include "radiance.h"

#include <algorithm>
#include <numbers>
#include <stdexcept>
#include <utility>

#include "blur.h"
#include "lamp_image.h"

namespace gonio::sim {
namespace {

constexpr std::size_t kKeptImages = 4;
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

/// One ray a pixel for plain targets; printed and polished ones have edges that matter. A lens
/// blurs before a sensor samples: prints, in which corners are looked for to a hundredth of a
/// pixel, are blurred in quarters of pixels. In whole ones, corners were 0.02 px off, alike for all
/// edges along the columns.
Sampling sampling_of(devices::Target target) {
  using devices::Target;
  switch (target) {
    case Target::sample:
    case Target::white:
    case Target::black_trap:
      return {1, 1, 1};
    case Target::board:
    case Target::board_turned:
      return {2, 13, 8};
    case Target::mirror:
    case Target::mirror_turned:
    case Target::black_glass:
    case Target::colour_chart:
      break;
  }
  return {1, 34, 21};
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
                                                              devices::Target target,
                                                              const Bands& bands) {
  Entry& entry = entry_of(joints, target);
  for (std::size_t band = 0; band < bands.size(); ++band) {
    if (!bands[band] || entry.done[band]) continue;
    blur(entry.contents, band, options_.camera.psf_sigma_px, entry.image->planes[band]);
    entry.done[band] = true;
  }
  return entry.image;
}

RadianceRenderer::Entry& RadianceRenderer::entry_of(const rig::Joints& joints,
                                                    devices::Target target) {
  const auto found = std::find_if(kept_.begin(), kept_.end(), [&](const Entry& entry) {
    return entry.target == target && entry.joints == joints;
  });
  if (found != kept_.end()) return *found;
  // Into the memory of the oldest: new pages for every picture cost as much as the picture.
  Entry entry;
  if (kept_.size() == kKeptImages) {
    entry = std::move(kept_.front());
    kept_.erase(kept_.begin());
  }
  if (!entry.image || entry.image.use_count() > 1) entry.image = std::make_shared<RadianceImage>();
  entry.joints = joints;
  entry.target = target;
  entry.done = {};
  entry.contents.look(view(joints, target), lens_, sampling_of(target));
  kept_.push_back(std::move(entry));
  return kept_.back();
}

TargetView RadianceRenderer::view(const rig::Joints& joints, devices::Target target) const {
  const rig::RigPose pose = rig::forward(options_.rig, joints);
  const Eigen::Isometry3d target_from_world =
      (pose.world_from_sample * mounted(mount_of(target))).inverse();
  return {scene_, target, target_from_world * pose.world_from_camera,
          Illumination(pose, target_from_world, options_.lamp, lamp_distance_mm_),
          LampImage(pose, target_from_world, options_.lamp, options_.camera)};
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

}  // namespace gonio::sim
