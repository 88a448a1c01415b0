#pragma once

#include "gonio/rig/kinematics.h"
#include "la2_layout.h"

namespace gonio::rig {

/// Numeric inverse of any rig for directions that pass their own limits: seeds, descents, random
/// restarts with a fixed seed, axis limits and keep-outs.
class PoseSearch {
 public:
  /// Copies the rig.
  explicit PoseSearch(const RigDescription& rig);

  /// Poses for one direction, light and detector exchanged if told: branch A (or C) and with
  /// `other_side` also B (or D).
  Reach find(const brdf::HalfDiff& direction, bool exchanged, bool other_side) const;

  /// A or B (C or D when exchanged) by the closed-form pose of that branch that is nearest to the
  /// joints, full turns aside; nothing on rigs far from an LA-2.
  std::optional<Branch> nearest_branch(const brdf::HalfDiff& direction, const Joints& joints,
                                       bool exchanged) const;

 private:
  struct Attempt;
  Attempt attempt(const brdf::DirectionPair& target, const Joints& seed, bool within_limits) const;
  Joints random_joints(std::uint64_t restart) const;
  void wrap_into_limits(Joints& joints) const;

  RigDescription rig_;
  std::optional<La2Layout> near_la2_;  ///< gives seeds for a misaligned LA-2
  std::vector<bool> turns_freely_;     ///< per axis: a full turn changes nothing
  bool redundant_ = false;             ///< more axes in the chains than a direction needs
};

}  // namespace gonio::rig
