#pragma once

#include <optional>

#include "gonio/rig/kinematics.h"

namespace gonio::rig {

/// What a direction itself must fulfil, whatever the pose: horizon, grazing, occlusion, footprint.
class DirectionChecks {
 public:
  DirectionChecks(const MeasurementLimits& limits, double camera_distance_mm);

  /// `exchanged`  Light and detector change places (branches C and D).
  std::optional<Reason> refusal_reason(const brdf::HalfDiff& direction, bool exchanged) const;
  /// The figures behind a reason from above.
  std::string detail(Reason reason, const brdf::HalfDiff& direction, bool exchanged) const;

 private:
  bool footprint_fits(double cos_theta_o) const;

  MeasurementLimits limits_;
  double cos_theta_i_max_;
  double cos_theta_o_max_;
  double camera_distance_mm_;
};

/// What the joints must fulfil: axis limits, keep-outs with kPlanningMargin.
std::optional<Reason> joints_refusal_reason(const RigDescription& rig, const Joints& joints);
std::string joints_refusal_detail(const RigDescription& rig, const Joints& joints);

}  // namespace gonio::rig
