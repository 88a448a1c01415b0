#include "session_checks.h"

#include <algorithm>
#include <utility>

#include "gonio/acquisition/itinerary.h"
#include "gonio/devices/homing_report.h"

namespace gonio::acquisition {
namespace {

/// Nominal times of checks, beside the ways there: what they take decides only whether one check
/// more is worth a shorter way.
constexpr double kHomeMarks_s = 8.0;
constexpr double kSentinel_s = 2.0;
constexpr double kWhiteInBetween_s = 60.0;

PlannedVisit stop(VisitKind kind, rig::Joints joints, double dwell_s) {
  return {kind, std::nullopt, {std::move(joints)}, {}, 0.0, dwell_s};
}

/// Adds a visit behind the others, with its way.
void go_to(const rig::TravelModel& travel, PlannedVisit visit, Itinerary& itinerary) {
  auto route = travel.route(itinerary.visits.back().pose.joints, visit.pose.joints);
  if (!route) throw PreflightError("pre-run check: keep-outs bar the way to or from a check");
  visit.via = std::move(route->via);
  visit.travel_s = route->seconds;
  itinerary.travel_s += visit.travel_s;
  itinerary.visits.push_back(std::move(visit));
}

}  // namespace

bool tells_home_delta(const DeviceSet& devices) {
  return std::any_of(devices.stages.begin(), devices.stages.end(), [](const auto* stage) {
    const auto* const report = dynamic_cast<const devices::HomingReport*>(stage);
    return report != nullptr && report->tells();
  });
}

bool has_sentinel(const MeasurementPlan& plan, const SessionOptions& options) {
  return options.sentinel_every > 0 &&
         (plan.points.size() > static_cast<std::size_t>(options.sentinel_every) ||
          plan.duration_s > devices::to_seconds(options.sentinel_interval));
}

SessionChecks SessionChecks::of(const MeasurementPlan& plan, const SessionOptions& options,
                                bool tells_home_delta) {
  SessionChecks checks;
  checks.home = tells_home_delta;
  checks.sentinel = has_sentinel(plan, options);
  checks.white = options.white_interval.count() > 0 && options.white != WhitePlacement::manual;
  return checks;
}

Itinerary with_session_checks(const rig::TravelModel& travel, const Itinerary& itinerary,
                              const SessionOptions& options, const SessionChecks& checks) {
  const auto is_white = [](const PlannedVisit& visit) { return visit.kind == VisitKind::white; };
  const auto opening = std::find_if(itinerary.visits.begin(), itinerary.visits.end(), is_white);
  if (opening == itinerary.visits.end()) return itinerary;
  const rig::Joints at_white = opening->pose.joints;
  PeriodicCheck trust;
  if (checks.home) {
    trust.stops.push_back(stop(VisitKind::home, travel.rig().home(), kHomeMarks_s));
  }
  if (checks.sentinel) trust.stops.push_back(stop(VisitKind::sentinel, at_white, kSentinel_s));

  Itinerary ends;
  for (auto visit = itinerary.visits.begin(); visit != itinerary.visits.end(); ++visit) {
    const bool closing = visit != opening && is_white(*visit);
    if (closing && !trust.stops.empty()) {
      for (const PlannedVisit& each : trust.stops) go_to(travel, each, ends);
      go_to(travel, *visit, ends);
    } else {
      ends.travel_s += visit->travel_s;
      ends.visits.push_back(*visit);
    }
    if (visit == opening && checks.sentinel) {
      ends.visits.push_back(stop(VisitKind::sentinel, at_white, kSentinel_s));
    }
  }
  if (checks.white) {
    PeriodicCheck white;
    white.stops.push_back(stop(VisitKind::white, at_white, kWhiteInBetween_s));
    white.every_s = devices::to_seconds(options.white_interval);
    ends = with_periodic_check(travel, ends, white);
  }
  // Without a sentinel home marks are compared in the end: what was lost shows there as well.
  if (!checks.sentinel) return ends;
  trust.every_points = static_cast<std::size_t>(options.sentinel_every);
  trust.every_s = devices::to_seconds(options.sentinel_interval);
  return with_periodic_check(travel, ends, trust);
}

}  // namespace gonio::acquisition
