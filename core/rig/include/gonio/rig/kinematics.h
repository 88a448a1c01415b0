#pragma once

#include <cstdint>
#include <string_view>
#include <functional>
#include <optional>
#include <string>
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

/// Forward kinematics of any rig.
RigPose forward(const RigDescription& rig, const Joints& joints);

/// Which of the equivalent poses of one BRDF direction: A as given; B mirrored to the other lamp
/// side; C light and detector exchanged (Helmholtz); D both. `bilateral` variants assume
/// f(phi_d) = f(-phi_d) and are off by default (rig_and_calibration 1.2).
enum class Branch { A, B, C, D };
char to_char(Branch branch);

struct BranchSet {
  bool reciprocal = true;  ///< C
  bool other_side = false;  ///< B, and D with reciprocal
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
  Branch branch;
};

/// All poses that realise a direction, or the reason there is none.
struct Reach {
  std::vector<PoseSolution> poses;
  std::optional<Refusal> refusal;  ///< set exactly when `poses` is empty
};

/// Inverse kinematics with limits. Closed form where the rig is an ideal LA-2, otherwise numeric
/// (Levenberg-Marquardt from the closed-form seeds and random restarts, fixed seed).
///
/// Threads  const, may be shared.
class Inverse {
 public:
  explicit Inverse(RigDescription rig, BranchSet branches = {});

  const RigDescription& rig() const { return rig_; }

  Reach solve(const brdf::HalfDiff& direction) const;

  /// Cheap test for masks over a million cells: same verdict as solve() on an ideal LA-2; on other
  /// rigs only the limits on polar angles and theta_d (solve() decides).
  bool maybe_reachable(const brdf::HalfDiff& direction) const;
  bool closed_form() const { return closed_form_; }

 private:
  RigDescription rig_;
  BranchSet branches_;
  bool closed_form_ = false;
};

}  // namespace gonio::rig
