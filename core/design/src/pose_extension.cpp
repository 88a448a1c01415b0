#include "gonio/design/pose_extension.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "pose_pool.h"

namespace gonio::design {
namespace {

// Around the best of the grid: each step half the one before, so far to either side.
constexpr double kFineSteps_deg[] = {2.0, 1.0, 0.5};
constexpr int kFineReach = 2;

PoseTrial trial_of(const basis::BasisRows& rows, std::span<const brdf::HalfDiff> kept,
                   const PatchGeometry& patch, const PoseNoise& noise) {
  PoseTrial trial;
  for (const brdf::HalfDiff& pose : kept) {
    trial.members.push_back({pose, pose_rows(rows, pose, patch, noise)});
  }
  return trial;
}

}  // namespace

PoseExtension extend_poses(const basis::Basis& basis, const Eigen::MatrixXd& importance,
                           const PoseCandidates& candidates, std::span<const brdf::HalfDiff> kept,
                           const PatchGeometry& patch, const PoseNoise& noise, int count) {
  patch.validate();
  noise.validate();
  if (count < 0) {
    throw std::invalid_argument("pose extension: count is " + std::to_string(count) +
                                ", expected 0 or more");
  }
  if (importance.rows() != basis.components.cols() || importance.cols() != importance.rows()) {
    throw std::invalid_argument("pose extension: importance of " +
                                std::to_string(importance.rows()) + " x " +
                                std::to_string(importance.cols()) + " for " +
                                std::to_string(basis.components.cols()) + " components");
  }
  const basis::BasisRows rows(basis);
  PoseDesignOptions options;
  options.noise = noise;
  PosePool grid(rows, candidates.poses, patch, importance, options, candidates.accept);
  PoseTrial trial = trial_of(rows, kept, patch, noise);
  while (trial.members.size() < kept.size() + static_cast<std::size_t>(count)) {
    const std::size_t before = trial.members.size();
    trial = grid.greedy(before + 1, std::move(trial));
    if (trial.members.size() == before) break;
    for (const double step_deg : kFineSteps_deg) {
      if (!candidates.allowed) break;
      PoseTrial others = trial;
      others.members.pop_back();
      PosePool near(
          rows, poses_around(trial.members.back().pose, step_deg, kFineReach, candidates.allowed),
          patch, importance, options, candidates.accept);
      PoseTrial finer = near.greedy(before + 1, std::move(others));
      if (finer.members.size() > before && finer.value < trial.value) trial = std::move(finer);
    }
  }
  PoseExtension found;
  for (std::size_t i = kept.size(); i < trial.members.size(); ++i) {
    found.poses.push_back(trial.members[i].pose);
  }
  found.before = expected_error(rows, importance, kept, patch, noise);
  std::vector<brdf::HalfDiff> all(kept.begin(), kept.end());
  all.insert(all.end(), found.poses.begin(), found.poses.end());
  found.after = expected_error(rows, importance, all, patch, noise);
  return found;
}

Angle pose_distance(const brdf::HalfDiff& a, const brdf::HalfDiff& b) {
  const double half_turns = (a.phi_d - b.phi_d).degrees() / 180.0;
  const double phi_d_deg = 180.0 * std::abs(half_turns - std::round(half_turns));
  // A turn about the half vector moves light and detector by theta_d, or the normal by theta_h.
  const double circle = std::sin(std::min(
      {a.theta_d.radians(), b.theta_d.radians(), a.theta_h.radians(), b.theta_h.radians()}));
  return Angle::from_degrees(
      std::max({std::abs((a.theta_h - b.theta_h).degrees()),
                std::abs((a.theta_d - b.theta_d).degrees()), circle * phi_d_deg}));
}

PoseCandidates away_from(PoseCandidates candidates, std::vector<brdf::HalfDiff> avoided,
                         Angle distance) {
  if (avoided.empty()) return candidates;
  auto far = [avoided = std::move(avoided), distance](const brdf::HalfDiff& pose) {
    return std::none_of(avoided.begin(), avoided.end(), [&](const brdf::HalfDiff& each) {
      return !(pose_distance(pose, each) > distance);
    });
  };
  std::erase_if(candidates.poses, [&](const brdf::HalfDiff& pose) { return !far(pose); });
  if (candidates.allowed) {
    candidates.allowed = [allowed = std::move(candidates.allowed), far = std::move(far)](
                             const brdf::HalfDiff& pose) { return far(pose) && allowed(pose); };
  }
  return candidates;
}

}  // namespace gonio::design
