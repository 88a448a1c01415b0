#include "pose_search.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "gonio/random/distributions.h"
#include "gonio/random/key.h"
#include "limit_checks.h"
#include "numeric_inverse.h"

namespace gonio::rig {
namespace {

// How far from an ideal LA-2 its closed form still gives useful seeds.
constexpr Angle kNearAngle = Angle::from_degrees(15.0);
constexpr double kNearLength_mm = 60.0;
constexpr std::uint64_t kRestarts = 20;
constexpr std::size_t kNeededAxes = 3;  // an isotropic direction pair has three degrees of freedom
constexpr Angle kSamePose = Angle::from_degrees(1e-4);  // descents from two seeds end this close

std::vector<bool> free_turns(const RigDescription& rig) {
  std::vector<bool> free(rig.axes.size(), true);
  for (const Chain* chain : {&rig.camera, &rig.lamp, &rig.sample}) {
    for (const ChainLink& link : chain->links) {
      if (std::abs(link.scale) != 1.0 || link.lead_mm_per_turn != 0.0) free[link.axis] = false;
    }
  }
  return free;
}

std::size_t axes_in_chains(const RigDescription& rig) {
  std::set<std::size_t> used;
  for (const Chain* chain : {&rig.camera, &rig.lamp, &rig.sample}) {
    for (const ChainLink& link : chain->links) used.insert(link.axis);
  }
  return used.size();
}

double distance(const Joints& a, const Joints& b) {
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    sum += (a[k] - b[k]).radians() * (a[k] - b[k]).radians();
  }
  return std::sqrt(sum);
}

bool known(const std::vector<PoseSolution>& poses, const Joints& joints) {
  return std::any_of(poses.begin(), poses.end(), [&](const PoseSolution& pose) {
    return distance(pose.joints, joints) < kSamePose.radians();
  });
}

}  // namespace

struct PoseSearch::Attempt {
  NumericSolution solution;
  bool converged = false;
  std::optional<Reason> limit;  ///< of a converged pose
  bool usable() const { return converged && !limit; }
};

PoseSearch::PoseSearch(const RigDescription& rig)
    : rig_(rig),
      near_la2_(La2Layout::of(rig, kNearAngle, kNearLength_mm)),
      turns_freely_(free_turns(rig)),
      redundant_(axes_in_chains(rig) > kNeededAxes) {}

void PoseSearch::wrap_into_limits(Joints& joints) const {
  for (std::size_t k = 0; k < joints.size(); ++k) {
    if (!turns_freely_[k]) continue;
    const Angle centre = (rig_.axes[k].min + rig_.axes[k].max) / 2.0;
    joints[k] = centre + wrap_to_half_turn(joints[k] - centre);
  }
}

PoseSearch::Attempt PoseSearch::attempt(const brdf::DirectionPair& target, const Joints& seed,
                                        bool within_limits) const {
  Attempt attempt{
      descend(rig_, target, seed, within_limits ? StayWithinLimits::Yes : StayWithinLimits::No),
      false, std::nullopt};
  attempt.converged = attempt.solution.residual < kSolvedResidual;
  wrap_into_limits(attempt.solution.joints);
  if (attempt.converged) attempt.limit = joints_refusal_reason(rig_, attempt.solution.joints);
  return attempt;
}

Joints PoseSearch::random_joints(std::uint64_t restart) const {
  const random::Key key = random::make_key(1, "rig.pose_search", restart);
  Joints joints;
  for (std::size_t k = 0; k < rig_.axes.size(); ++k) {
    const Axis& axis = rig_.axes[k];
    joints.push_back(axis.min + (axis.max - axis.min) * random::uniform(key, k));
  }
  return joints;
}

std::optional<Branch> PoseSearch::nearest_branch(const brdf::HalfDiff& direction,
                                                 const Joints& joints, bool exchanged) const {
  if (!near_la2_) return std::nullopt;
  const auto distance_to = [&](Branch branch) {
    Joints closed_form = near_la2_->joints_for(direction, branch);
    for (std::size_t k = 0; k < joints.size(); ++k) {
      if (turns_freely_[k]) {
        closed_form[k] = joints[k] + wrap_to_half_turn(closed_form[k] - joints[k]);
      }
    }
    return distance(joints, closed_form);
  };
  const Branch here = exchanged ? Branch::C : Branch::A;
  const Branch there = exchanged ? Branch::D : Branch::B;
  return distance_to(here) <= distance_to(there) ? here : there;
}

Reach PoseSearch::find(const brdf::HalfDiff& direction, bool exchanged, bool other_side) const {
  const Branch here = exchanged ? Branch::C : Branch::A;
  const Branch there = exchanged ? Branch::D : Branch::B;
  brdf::DirectionPair target = brdf::directions_from_half_diff(
      {direction.theta_h, direction.theta_d, direction.phi_d, Angle()});
  if (exchanged) std::swap(target.wi, target.wo);

  std::vector<std::pair<Branch, Joints>> seeds;
  if (near_la2_) {
    seeds.emplace_back(here, near_la2_->joints_for(direction, here));
    if (other_side) seeds.emplace_back(there, near_la2_->joints_for(direction, there));
  } else {
    seeds.emplace_back(here, rig_.home());
  }

  Reach reach;
  double smallest_residual = std::numeric_limits<double>::infinity();
  const auto note = [&](const Attempt& attempt) {
    smallest_residual = std::min(smallest_residual, attempt.solution.residual);
    if (attempt.limit && !reach.refusal) {
      reach.refusal = Refusal{*attempt.limit, joints_refusal_detail(rig_, attempt.solution.joints)};
    }
  };
  for (const auto& [branch, seed] : seeds) {
    Attempt free = attempt(target, seed, false);
    note(free);
    if (!free.usable() && redundant_) {
      free = attempt(target, seed, true);
      note(free);
    }
    if (free.usable() && !known(reach.poses, free.solution.joints)) {
      reach.poses.push_back({free.solution.joints, branch});
    }
  }

  // A misaligned LA-2 has one pose per branch, which the seeds have found or shown to be barred;
  // elsewhere there may be more of them.
  const bool settled = near_la2_ && !redundant_ && reach.refusal;
  for (std::uint64_t restart = 0; restart < kRestarts && !settled; ++restart) {
    const bool enough =
        !reach.poses.empty() && (near_la2_ || !other_side || reach.poses.size() > 1);
    if (enough) break;
    const Attempt clamped = attempt(target, random_joints(restart), true);
    note(clamped);
    if (!clamped.usable() || known(reach.poses, clamped.solution.joints)) continue;
    Branch branch = reach.poses.empty() ? here : there;
    if (const auto nearest = nearest_branch(direction, clamped.solution.joints, exchanged)) {
      branch = *nearest;
      if (branch == there && !other_side) continue;
    }
    reach.poses.push_back({clamped.solution.joints, branch});
  }

  if (!reach.poses.empty()) {
    reach.refusal.reset();
  } else if (!reach.refusal) {
    reach.refusal = Refusal{Reason::NoInverse,
                            fmt::format("no pose within the axis limits shows this direction; "
                                        "closest by {:.2g} rad",
                                        smallest_residual)};
  }
  return reach;
}

}  // namespace gonio::rig
