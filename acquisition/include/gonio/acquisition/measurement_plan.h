#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <vector>

#include "gonio/rig/travel.h"
#include "gonio/samples/samples.h"

namespace gonio::acquisition {

/// A direction with the pose chosen for it.
struct PlannedPoint {
  brdf::HalfDiff direction;
  rig::PoseSolution pose;
  double travel_s = 0.0;     ///< from the point before (the first: from the white)
  double predicted_s = 0.0;  ///< travel, settling and exposures
};

struct RefusedDirection {
  samples::Direction direction;
  rig::Refusal refusal;
};

/// Points in visiting order, and what cannot be measured with the reason.
struct MeasurementPlan {
  std::vector<PlannedPoint> points;
  std::vector<RefusedDirection> refused;
  double travel_s = 0.0;  ///< from the opening white over the points to the closing one
  double lower_bound_s = 0.0;
  bool exact_order = false;
  double duration_s = 0.0;  ///< points, whites, darks
};

/// Where the tour of a plan's points begins and ends: at the white (white_joints()). Home on a rig
/// without a pose for it: such a session is refused, but its plan may be looked at.
rig::Joints tour_ends(const rig::RigDescription& rig);

/// Chooses poses and the shortest order from the opening white over all points to the closing one:
/// there and back, so that no angle only rises with time. `point_seconds` is the expected time of
/// the exposures of one point, `overhead_seconds` of everything that is not a point. A direction
/// without a pose, or whose poses keep-outs bar, goes to `refused` with its reason.
MeasurementPlan make_plan(const rig::Inverse& inverse,
                          const std::vector<samples::Direction>& directions, double point_seconds,
                          double overhead_seconds, std::uint64_t seed = 1);

}  // namespace gonio::acquisition
