#include "session_checks.h"

#include <algorithm>

#include "gonio/acquisition/itinerary.h"
#include "gonio/devices/homing_report.h"

namespace gonio::acquisition {

bool tells_home_delta(const DeviceSet& devices) {
  return std::any_of(devices.stages.begin(), devices.stages.end(), [](const auto* stage) {
    return dynamic_cast<const devices::HomingReport*>(stage) != nullptr;
  });
}

bool has_sentinel(const MeasurementPlan& plan, const SessionOptions& options) {
  return options.sentinel_every > 0 &&
         (plan.points.size() > static_cast<std::size_t>(options.sentinel_every) ||
          plan.duration_s > devices::to_seconds(options.sentinel_interval));
}

Itinerary with_session_checks(const rig::TravelModel& travel, const Itinerary& itinerary,
                              const MeasurementPlan& plan, const SessionOptions& options,
                              bool home_checks) {
  const bool sentinels = has_sentinel(plan, options);
  Itinerary result;
  const auto add = [&](PlannedVisit visit) {
    result.travel_s += visit.travel_s;
    result.visits.push_back(std::move(visit));
  };
  const auto go_to = [&](PlannedVisit visit) {
    auto route = travel.route(result.visits.back().pose.joints, visit.pose.joints);
    if (!route) throw PreflightError("pre-run check: keep-outs bar the way to or from a check");
    visit.via = std::move(route->via);
    visit.travel_s = route->seconds;
    add(std::move(visit));
  };
  const rig::PoseSolution home{travel.rig().home()};
  rig::PoseSolution sentinel;
  std::size_t points = 0;
  double lasts_s = 0.0;
  for (const PlannedVisit& visit : itinerary.visits) {
    const bool due = points > 0 && sentinels &&
                     (points >= static_cast<std::size_t>(options.sentinel_every) ||
                      lasts_s >= devices::to_seconds(options.sentinel_interval));
    const bool last = points > 0 && visit.kind == VisitKind::white && (sentinels || home_checks);
    if (due || last) {
      if (home_checks) go_to({VisitKind::home, std::nullopt, home, {}, 0.0, 0.0});
      if (sentinels) go_to({VisitKind::sentinel, std::nullopt, sentinel, {}, 0.0, 0.0});
      go_to(visit);
      points = 0;
      lasts_s = 0.0;
    } else {
      add(visit);
    }
    lasts_s += visit.travel_s + visit.dwell_s;
    if (visit.kind == VisitKind::point) ++points;
    if (visit.kind == VisitKind::white && sentinel.joints.empty()) {
      sentinel = visit.pose;
      if (sentinels) add({VisitKind::sentinel, std::nullopt, sentinel, {}, 0.0, 0.0});
    }
  }
  return result;
}

}  // namespace gonio::acquisition
