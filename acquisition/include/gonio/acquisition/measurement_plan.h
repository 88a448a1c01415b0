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
  /// Measured on purpose though its direction stands in the plan before: the second half of a pair.
  bool again = false;
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

/// Pairs of measurements that have to agree.
struct PairOptions {
  int repeats = 0;      ///< points measured again at the same pose, half the session's points later
  int reciprocals = 0;  ///< points measured again with light and camera exchanged
};

/// Adds the second halves of the pairs as points of their own. The first halves are spread over the
/// session: one from each of as many stretches of it (of its first half for repeats), each with the
/// second half where the detour is least, so that a drift shows as a difference and not as an
/// angle. Points without a pose for the exchanged geometry make no reciprocal pair; there may be
/// fewer pairs than asked for.
MeasurementPlan with_pairs(const rig::Inverse& inverse, const MeasurementPlan& plan,
                           const PairOptions& options);

}  // namespace gonio::acquisition
