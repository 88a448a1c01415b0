#pragma once

#include <limits>
#include <optional>
#include <string_view>
#include <vector>

#include "gonio/acquisition/measurement_plan.h"
#include "gonio/acquisition/session.h"
#include "gonio/rig/travel.h"

namespace gonio::acquisition {

/// What a rig goes somewhere for.
///   home         homing; nobody knows where the axes stand before
///   dark         frames behind the closed shutter, without a move
///   white        the white reference at its pose
///   point        a point of the plan
///   sentinel     a fixed geometry of the sample, measured again and again
///   park         back home
enum class VisitKind { home, dark, white, point, sentinel, park };
std::string_view to_string(VisitKind kind);

struct PlannedVisit {
  VisitKind kind = VisitKind::point;
  std::optional<std::size_t> point;  ///< index into the plan; of a point
  rig::PoseSolution pose;
  std::vector<rig::Joints> via;  ///< stops on the way there, around keep-outs
  double travel_s = 0.0;         ///< from the visit before
  /// What is done there: as forecast, or else as far as the plan knows it, and then 0 for whatever
  /// is no point of it.
  double dwell_s = 0.0;
};

/// A session as data: all it goes to, in order.
struct Itinerary {
  std::vector<PlannedVisit> visits;
  double travel_s = 0.0;
};

/// Where the white is measured: 45:0 (theta_i = 45, theta_o = 0 deg), or the nearest of 30
/// directions to it that the rig reaches from home and back. Throws PreflightError when there is
/// none.
rig::Joints white_joints(const rig::RigDescription& rig);

/// What run_session() does but for its checks: home, darks, opening white, the plan's points in its
/// order, closing white, park. `white` is the pose of the white reference. Throws PreflightError
/// naming the stop when keep-outs bar every known way to one.
Itinerary session_itinerary(const rig::TravelModel& travel, const MeasurementPlan& plan,
                            const rig::Joints& white);

/// What run_session() looks at between the points.
struct SessionChecks {
  bool home = false;  ///< home marks: an axis tells its home delta
  bool sentinel = false;
  bool white = false;  ///< whites between the opening and the closing one

  /// As options and plan ask for, on devices that tell their home deltas or not.
  static SessionChecks of(const MeasurementPlan& plan, const SessionOptions& options,
                          bool tells_home_delta);
};

/// With these checks: the sentinel behind the opening white, home marks and sentinel before the
/// closing one, and in between, at most SessionOptions::sentinel_every points or sentinel_interval
/// apart, where their detours cost least; whites likewise, at most white_interval apart. The
/// sentinel's pose is the white's. Throws PreflightError when keep-outs bar the way there.
Itinerary with_session_checks(const rig::TravelModel& travel, const Itinerary& itinerary,
                              const SessionOptions& options, const SessionChecks& checks);

/// A check that comes again and again between the points.
struct PeriodicCheck {
  /// Where it goes and what for, in this order: home marks, then the sentinel. Their dwell_s
  /// counts, changes of the target included: fewer checks save it.
  std::vector<PlannedVisit> stops;
  /// Most points, and most seconds, from one check to the next, from the opening white to the first
  /// and from the last to the closing white. Where a single point takes longer, it stands alone.
  std::size_t every_points = std::numeric_limits<std::size_t>::max();
  double every_s = std::numeric_limits<double>::infinity();
};

/// Puts the check between the points where its detours, and what it takes itself, come to the least
/// time in all, which is found exactly. Visits before the first point and behind the last stay as
/// they are. Throws std::invalid_argument for every_points = 0, every_s not above 0 or no stop;
/// PreflightError when no place allowed has a way there.
Itinerary with_periodic_check(const rig::TravelModel& travel, const Itinerary& itinerary,
                              const PeriodicCheck& check);

/// How far a drift, linear in time, could pass for the shape of a BRDF: Pearson's correlation of
/// the time at which points are measured with their angles; each -1 to 1, 0 where there is no
/// spread.
struct DriftAliasing {
  double theta_h = 0.0;
  double theta_d = 0.0;
  double phi_d = 0.0;
  /// Share of the variance of time that the three angles explain together by least squares, less
  /// what as many random columns would: 0 to 1.
  double explained = 0.0;
};
DriftAliasing drift_aliasing(const Itinerary& itinerary, const MeasurementPlan& plan);

}  // namespace gonio::acquisition
