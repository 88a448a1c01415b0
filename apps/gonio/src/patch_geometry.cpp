#include "patch_geometry.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "gonio/console/failures.h"
#include "gonio/rig/kinematics.h"

namespace gonio::cli {
namespace {

constexpr double kAssumedHalfWidth_mm = 25.0;
constexpr double kSmallestHalfWidth_mm = 0.1;  // a pixel or less: ask for points
constexpr double kLargestHalfWidth_mm = 500.0;

}  // namespace

double camera_distance_mm(const rig::RigDescription& rig) {
  const rig::RigPose pose = rig::forward(rig, rig.home());
  return (pose.world_from_camera.translation() - pose.world_from_sample.translation()).norm();
}

double lamp_distance_mm(const rig::RigDescription& rig) {
  const rig::RigPose pose = rig::forward(rig, rig.home());
  return (pose.world_from_lamp.translation() - pose.world_from_sample.translation()).norm();
}

design::PatchGeometry patch_of(const KnownRig& rig) {
  const acquisition::ReductionOptions& reduction = rig.file.reduction;
  design::PatchGeometry patch;
  patch.grid = reduction.grid;
  patch.camera_distance_mm = camera_distance_mm(rig.constants.rig);
  patch.lamp_distance_mm = lamp_distance_mm(rig.constants.rig);
  if (patch.grid == 1) return patch;
  // The outermost spots touch the usable edge, the squares of a patch fill it.
  const double outermost_mm =
      reduction.sample_half_width_mm - reduction.edge_margin_mm - reduction.spot_half_width_mm;
  patch.half_width_mm = outermost_mm * patch.grid / (patch.grid - 1.0);
  return patch;
}

design::PatchGeometry planned_patch(const std::string& word, const KnownRig* rig) {
  if (word == "auto") {
    return rig != nullptr ? patch_of(*rig)
                          : design::PatchGeometry::of_half_width(kAssumedHalfWidth_mm);
  }
  double half_width_mm = 0.0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), half_width_mm);
  if (error != std::errc() || end != word.data() + word.size() ||
      !(half_width_mm == 0.0 ||
        (half_width_mm >= kSmallestHalfWidth_mm && half_width_mm <= kLargestHalfWidth_mm))) {
    throw UsageError(fmt::format("--patch: found '{}', expected auto, 0 or {} to {} mm", word,
                                 kSmallestHalfWidth_mm, kLargestHalfWidth_mm));
  }
  design::PatchGeometry patch = design::PatchGeometry::of_half_width(half_width_mm);
  if (rig != nullptr) {
    patch.camera_distance_mm = camera_distance_mm(rig->constants.rig);
    patch.lamp_distance_mm = lamp_distance_mm(rig->constants.rig);
  }
  return patch;
}

std::string to_text(const design::PatchGeometry& patch) {
  if (patch.is_point()) return "points";
  return fmt::format("patches of +-{:g} mm ({} x {})", patch.half_width_mm, patch.grid, patch.grid);
}

design::PoseNoise planned_noise(const KnownRig* rig, std::optional<double> relative) {
  design::PoseNoise noise;
  if (rig != nullptr) {
    const instrument::Instrument& known = rig->constants;
    noise.common =
        std::hypot(known.white.u_relative, known.u_lamp_relative, known.u_linearity_relative);
  }
  noise.independent = relative.value_or(noise.independent);
  return noise;
}

}  // namespace gonio::cli
