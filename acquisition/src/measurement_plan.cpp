#include "gonio/acquisition/measurement_plan.h"

#include <numeric>

#include "gonio/acquisition/itinerary.h"

namespace gonio::acquisition {

rig::Joints tour_ends(const rig::RigDescription& rig) {
  try {
    return white_joints(rig);
  } catch (const PreflightError&) {
    return rig.home();
  }
}

MeasurementPlan make_plan(const rig::Inverse& inverse,
                          const std::vector<samples::Direction>& directions, double point_seconds,
                          double overhead_seconds, std::uint64_t seed) {
  MeasurementPlan plan;
  std::vector<rig::TourStop> stops;
  std::vector<brdf::HalfDiff> reachable;
  for (const samples::Direction& direction : directions) {
    rig::Reach reach = inverse.solve(direction.angles);
    if (reach.refusal) {
      plan.refused.push_back({direction, *reach.refusal});
      continue;
    }
    stops.push_back({std::move(reach.poses), point_seconds});
    reachable.push_back(direction.angles);
  }
  const rig::TravelModel travel(inverse.rig());
  const rig::Joints ends = tour_ends(inverse.rig());
  rig::TourOptions options;
  options.seed = seed;
  options.end = ends;
  const rig::Tour tour = rig::shortest_tour(travel, ends, stops, options);
  for (const rig::TourVisit& visit : tour.visits) {
    plan.points.push_back({reachable[visit.stop], stops[visit.stop].alternatives[visit.alternative],
                           visit.travel_s, visit.travel_s + point_seconds});
  }
  for (const std::size_t stop : tour.blocked) {
    samples::Direction direction;
    direction.angles = reachable[stop];
    plan.refused.push_back(
        {direction, {rig::Reason::PathBlocked, "keep-outs bar the way to all its poses"}});
  }
  plan.travel_s = tour.travel_s;
  plan.lower_bound_s = tour.lower_bound_s;
  plan.exact_order = tour.exact;
  plan.duration_s = std::accumulate(
      plan.points.begin(), plan.points.end(), overhead_seconds,
      [](double sum, const PlannedPoint& point) { return sum + point.predicted_s; });
  return plan;
}

}  // namespace gonio::acquisition
