#include <fmt/format.h>

#include <stdexcept>

#include "gonio/rig/kinematics.h"
#include "la2_layout.h"
#include "limit_checks.h"
#include "pose_search.h"
#include "tolerance.h"

namespace gonio::rig {

/// One way of realising a direction.
struct InverseCandidate {
  Branch branch;
  bool mirrored;
};

namespace {

// Exactly an LA-2 but for rounding in how it was written down.
constexpr Angle kIdealAngle = Angle::from_radians(1e-13);
constexpr double kIdealLength_mm = 1e-9;

bool exchanged(const InverseCandidate& candidate) {
  return candidate.branch == Branch::C || candidate.branch == Branch::D;
}

std::vector<InverseCandidate> candidates_of(const BranchSet& branches) {
  std::vector<InverseCandidate> candidates;
  for (const bool mirrored : {false, true}) {
    if (mirrored && !branches.bilateral) break;
    candidates.push_back({Branch::A, mirrored});
    if (branches.other_side) candidates.push_back({Branch::B, mirrored});
    if (branches.reciprocal) candidates.push_back({Branch::C, mirrored});
    if (branches.other_side && branches.reciprocal) candidates.push_back({Branch::D, mirrored});
  }
  return candidates;
}

brdf::HalfDiff target_of(brdf::HalfDiff direction, bool mirrored) {
  if (mirrored) direction.phi_d = -direction.phi_d;
  return direction;
}

void check_range(const brdf::HalfDiff& direction) {
  const Angle top = Angle::from_degrees(90.0) + kAngleTolerance;
  const auto polar = [&](Angle angle) { return angle >= Angle() && angle <= top; };
  if (!polar(direction.theta_h) || !polar(direction.theta_d) ||
      !(abs(direction.phi_d) <= Angle::from_degrees(360.0))) {
    throw std::invalid_argument(fmt::format(
        "Inverse: direction ({}, {}, {}) deg, expected theta_h and theta_d in [0, 90]",
        direction.theta_h.degrees(), direction.theta_d.degrees(), direction.phi_d.degrees()));
  }
}

}  // namespace

struct Inverse::State {
  RigDescription rig;
  BranchSet branches;
  std::vector<InverseCandidate> candidates;
  DirectionChecks checks;
  std::optional<La2Layout> ideal;
  PoseSearch search;

  State(RigDescription description, BranchSet branch_set)
      : rig(std::move(description)),
        branches(branch_set),
        candidates(candidates_of(branches)),
        checks(rig.limits, home_camera_distance_mm(rig)),
        ideal(La2Layout::of(rig, kIdealAngle, kIdealLength_mm)),
        search(rig) {}

  static double home_camera_distance_mm(const RigDescription& rig) {
    rig.validate();
    const RigPose pose = forward(rig, rig.home());
    return (pose.world_from_camera.translation() - pose.world_from_sample.translation()).norm();
  }

  Reach solve_in_closed_form(const brdf::HalfDiff& direction) const;
  Reach solve_numerically(const brdf::HalfDiff& direction) const;
};

Reach Inverse::State::solve_in_closed_form(const brdf::HalfDiff& direction) const {
  Reach reach;
  for (const InverseCandidate& candidate : candidates) {
    std::optional<Refusal> refusal;
    Joints joints;
    if (const auto reason = checks.refusal_reason(direction, exchanged(candidate))) {
      refusal = Refusal{*reason, checks.detail(*reason, direction, exchanged(candidate))};
    } else {
      joints = ideal->joints_for(target_of(direction, candidate.mirrored), candidate.branch);
      if (const auto limit = joints_refusal_reason(rig, joints)) {
        refusal = Refusal{*limit, joints_refusal_detail(rig, joints)};
      }
    }
    if (!refusal) reach.poses.push_back({joints, candidate.branch, candidate.mirrored});
    if (!reach.refusal) reach.refusal = refusal;
  }
  if (!reach.poses.empty()) reach.refusal.reset();
  return reach;
}

Reach Inverse::State::solve_numerically(const brdf::HalfDiff& direction) const {
  Reach reach;
  for (const bool mirrored : {false, true}) {
    if (mirrored && !branches.bilateral) break;
    for (const bool exchange : {false, true}) {
      if (exchange && !branches.reciprocal) break;
      if (const auto reason = checks.refusal_reason(direction, exchange)) {
        if (!reach.refusal) {
          reach.refusal = Refusal{*reason, checks.detail(*reason, direction, exchange)};
        }
        continue;
      }
      Reach found = search.find(target_of(direction, mirrored), exchange, branches.other_side);
      for (PoseSolution& pose : found.poses) {
        pose.mirrored = mirrored;
        reach.poses.push_back(std::move(pose));
      }
      if (!reach.refusal) reach.refusal = found.refusal;
    }
  }
  if (!reach.poses.empty()) reach.refusal.reset();
  return reach;
}

Inverse::Inverse(RigDescription rig, BranchSet branches)
    : state_(std::make_shared<const State>(std::move(rig), branches)) {}

const RigDescription& Inverse::rig() const { return state_->rig; }
bool Inverse::closed_form() const { return state_->ideal.has_value(); }

Reach Inverse::solve(const brdf::HalfDiff& direction) const {
  check_range(direction);
  return closed_form() ? state_->solve_in_closed_form(direction)
                       : state_->solve_numerically(direction);
}

std::optional<Reason> Inverse::refusal_reason(const brdf::HalfDiff& direction) const {
  check_range(direction);
  std::optional<Reason> first;
  for (const InverseCandidate& candidate : state_->candidates) {
    auto reason = state_->checks.refusal_reason(direction, exchanged(candidate));
    if (!reason && closed_form()) {
      reason = joints_refusal_reason(
          state_->rig,
          state_->ideal->joints_for(target_of(direction, candidate.mirrored), candidate.branch));
    }
    if (!reason) return std::nullopt;
    if (!first) first = reason;
  }
  return first;
}

bool Inverse::on_named_side(const brdf::HalfDiff& direction, const PoseSolution& pose) const {
  const bool exchange = exchanged({pose.branch, pose.mirrored});
  const auto nearest =
      state_->search.nearest_branch(target_of(direction, pose.mirrored), pose.joints, exchange);
  return !nearest || *nearest == pose.branch;
}

bool Inverse::maybe_reachable(const brdf::HalfDiff& direction) const {
  return !refusal_reason(direction).has_value();
}

}  // namespace gonio::rig
