#include "pose_choice.h"

#include <fmt/format.h>

#include <cmath>

#include "gonio/console/failures.h"
#include "gonio/design/pose_exchange.h"

namespace gonio::cli {
namespace {

constexpr double kGridStepDeg = 2.0;

}  // namespace

std::vector<brdf::HalfDiff> choose_poses(const Console& console, const basis::Basis& basis,
                                         const Eigen::MatrixXd& importance,
                                         const rig::Inverse* inverse, const PoseRequest& request,
                                         const std::stop_token& stop) {
  design::PoseCandidates candidates;
  if (inverse == nullptr) {
    candidates.allowed = [](const brdf::HalfDiff& pose) {
      return design::within(design::DirectionLimits{}, pose);
    };
  } else {
    candidates.allowed = [inverse](const brdf::HalfDiff& pose) {
      return inverse->maybe_reachable(pose);
    };
    if (!inverse->closed_form()) {
      candidates.accept = [inverse](const brdf::HalfDiff& pose) {
        return !inverse->solve(pose).poses.empty();
      };
    }
  }
  candidates.poses = design::pose_grid(kGridStepDeg, candidates.allowed);
  if (candidates.poses.size() < static_cast<std::size_t>(request.pose_count)) {
    throw UsageError(fmt::format("found {} reachable poses, expected at least the {} asked for",
                                 candidates.poses.size(), request.pose_count));
  }
  const PhaseTimer timer(console, "choosing poses");
  Progress progress(console, fmt::format("choosing among {} poses", candidates.poses.size()));
  design::PoseDesignOptions options;
  options.pose_count = request.pose_count;
  options.noise = request.noise;
  options.seed = request.seed;
  return design::choose_poses(
             basis, importance, candidates, request.patch.coarse(), options,
             [&](const design::SearchProgress& now) { progress.update(now.fraction); }, stop)
      .poses;
}

std::string sample_size_text(const basis::Basis& basis, const Eigen::MatrixXd& importance,
                             const std::vector<brdf::HalfDiff>& poses, const PoseRequest& request) {
  const basis::BasisRows rows(basis);
  const auto error = [&](const design::PatchGeometry& patch) {
    return std::sqrt(design::expected_error(rows, importance, poses, patch, request.noise));
  };
  std::string text = fmt::format(
      "expected weighted log error of these poses: {:.4f} as points, {:.4f} as planned; with\n",
      error({}), error(request.patch));
  for (const double half_width_mm : {12.0, 25.0, 50.0}) {
    design::PatchGeometry patch = design::PatchGeometry::of_half_width(half_width_mm);
    patch.camera_distance_mm = request.patch.camera_distance_mm;
    patch.lamp_distance_mm = request.patch.lamp_distance_mm;
    text += fmt::format("  a sample of +-{:<3g} mm  {:.4f}\n", half_width_mm, error(patch));
  }
  if (request.patch.is_point()) return text;
  for (const double factor : {0.7, 1.4}) {
    design::PatchGeometry patch = request.patch;
    patch.camera_distance_mm *= factor;
    text += fmt::format("  the camera at {:<4.0f} mm  {:.4f}\n", patch.camera_distance_mm,
                        error(patch));
  }
  for (const double factor : {0.7, 1.4}) {
    design::PatchGeometry patch = request.patch;
    patch.lamp_distance_mm *= factor;
    text +=
        fmt::format("  the lamp at {:<4.0f} mm    {:.4f}\n", patch.lamp_distance_mm, error(patch));
  }
  return text;
}

}  // namespace gonio::cli
