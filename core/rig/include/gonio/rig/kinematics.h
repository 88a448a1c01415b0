#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gonio/brdf/directions.h"
#include "gonio/rig/rig_description.h"

namespace gonio::rig {

/// Where the three tips stand for one set of joints. Lengths in mm.
struct RigPose {
  Eigen::Isometry3d world_from_camera;
  Eigen::Isometry3d world_from_lamp;
  Eigen::Isometry3d world_from_sample;
  bool collimated_lamp = false;

  /// Directions at a point of the sample (sample frame, mm): towards lamp and camera centre.
  brdf::DirectionPair directions_at(const Eigen::Vector3d& point_in_sample_mm) const;
};

/// Forward kinematics of any rig, by product of exponentials. Joints outside the limits are
/// computed like any other. Throws std::invalid_argument unless there is one joint per axis.
RigPose forward(const RigDescription& rig, const Joints& joints);

/// Which of the equivalent poses of one BRDF direction: A as given; B mirrored to the other lamp
/// side; C light and detector exchanged (Helmholtz); D both. On rigs other than LA-2, B and D are
/// further poses of A and C that the search has found.
enum class Branch { A, B, C, D };
char to_char(Branch branch);

/// Which of them may be used besides A.
struct BranchSet {
  bool reciprocal = true;   ///< C
  bool other_side = false;  ///< B, and D with reciprocal
  /// Also poses for f(phi_d) = f(-phi_d), which holds for most materials but is not part of the
  /// MERL model: useful as a check of the sample.
  bool bilateral = false;
};

/// Why a direction cannot be measured. `AxisLimit` and `KeepOut` carry a name in Refusal::detail.
enum class Reason {
  BelowHorizon,
  GrazingIn,
  GrazingOut,
  OccludedLamp,
  AxisLimit,
  KeepOut,
  NoInverse,
  Footprint,
  PathBlocked
};
std::string_view to_string(Reason reason);  ///< "BELOW_HORIZON", "GRAZING_IN", ...

struct Refusal {
  Reason reason;
  std::string detail;  ///< one phrase with the figures: "theta_i 91.7 deg, at most 80.0"
};

struct PoseSolution {
  Joints joints;
  Branch branch = Branch::A;
  bool mirrored = false;  ///< for -phi_d (BranchSet::bilateral)
};

/// "A", or "A'" when mirrored.
std::string branch_name(const PoseSolution& pose);

/// All poses that realise a direction, or the reason there is none.
struct Reach {
  std::vector<PoseSolution> poses;
  std::optional<Refusal> refusal;  ///< set exactly when `poses` is empty
};

/// Inverse kinematics with limits. Closed form where the rig is an ideal LA-2, otherwise numeric
/// (Levenberg-Marquardt from the closed-form seeds and random restarts, fixed seed).
///
/// Nominal  A pose realises a direction at the sample origin; other points of the sample see
///          others (RigPose::directions_at).
/// Redundancy  Axes that the direction does not need (a spin about the normal) stay at home on an
///          LA-2, near the seed elsewhere.
/// Threads  const, may be shared.
class Inverse {
 public:
  /// Throws std::invalid_argument for an invalid rig.
  explicit Inverse(RigDescription rig, BranchSet branches = {});

  const RigDescription& rig() const;

  /// All allowed poses, branch A first if it is there. With none, the refusal says why branch A
  /// (as the direction is given) is none. `direction` may have any phi_d; phi_h is ignored.
  Reach solve(const brdf::HalfDiff& direction) const;

  /// Cheap test for masks over a million cells: same verdict as solve() on an ideal LA-2; on other
  /// rigs only the limits on polar angles, theta_d and footprint (solve() decides).
  bool maybe_reachable(const brdf::HalfDiff& direction) const;

  /// The reason of solve()'s refusal without its text, as cheap as maybe_reachable() and with the
  /// same reservation; nothing when reachable.
  std::optional<Reason> refusal_reason(const brdf::HalfDiff& direction) const;

  /// Whether a pose that shows `direction` is named by the branch its lamp side says. True on rigs
  /// that are no LA-2, not even a misaligned one, where sides have no names. Limits are not looked
  /// at, nor whether the pose shows the direction.
  bool on_named_side(const brdf::HalfDiff& direction, const PoseSolution& pose) const;

  bool closed_form() const;

 private:
  struct State;
  std::shared_ptr<const State> state_;  ///< immutable, so copies may share it
};

}  // namespace gonio::rig
