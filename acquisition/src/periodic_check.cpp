#include <algorithm>
#include <stdexcept>
#include <string>

#include "gonio/acquisition/itinerary.h"
#include "ways.h"

namespace gonio::acquisition {
namespace {

/// What a check takes itself: its stops, and the ways from one to the next.
double inner_s(const rig::TravelModel& travel, const PeriodicCheck& check) {
  double sum = 0.0;
  for (std::size_t i = 0; i < check.stops.size(); ++i) {
    sum += check.stops[i].dwell_s;
    if (i > 0)
      sum += seconds_between(travel, check.stops[i - 1].pose.joints, check.stops[i].pose.joints);
  }
  return sum;
}

/// What the way to a check and on costs more than the way from the visit at `place` to the next.
double detour_s(const rig::TravelModel& travel, const Itinerary& itinerary, std::size_t place,
                const PeriodicCheck& check) {
  const PlannedVisit& after = itinerary.visits[place + 1];
  return seconds_between(travel, itinerary.visits[place].pose.joints,
                         check.stops.front().pose.joints) +
         seconds_between(travel, check.stops.back().pose.joints, after.pose.joints) -
         after.travel_s;
}

/// With the check behind each of the visits at `places` (ascending), ways and times found anew.
Itinerary inserted(const rig::TravelModel& travel, const Itinerary& itinerary,
                   const std::vector<std::size_t>& places, const PeriodicCheck& check) {
  Itinerary result;
  const auto add = [&](PlannedVisit visit, bool new_way) {
    if (new_way) {
      auto route = travel.route(result.visits.back().pose.joints, visit.pose.joints);
      // Places without a way there and on have been left out.
      if (!route) throw PreflightError("pre-run check: keep-outs bar the way to a check");
      visit.via = std::move(route->via);
      visit.travel_s = route->seconds;
    }
    result.travel_s += visit.travel_s;
    result.visits.push_back(std::move(visit));
  };
  auto next = places.begin();
  bool was_inserted = false;
  for (std::size_t i = 0; i < itinerary.visits.size(); ++i) {
    add(itinerary.visits[i], was_inserted);
    was_inserted = next != places.end() && *next == i;
    if (!was_inserted) continue;
    for (const PlannedVisit& stop : check.stops) add(stop, true);
    ++next;
  }
  return result;
}

}  // namespace

Itinerary with_periodic_check(const rig::TravelModel& travel, const Itinerary& itinerary,
                              const PeriodicCheck& check) {
  if (check.every_points == 0) {
    throw std::invalid_argument("with_periodic_check: every_points is 0, expected at least 1");
  }
  if (!(check.every_s > 0.0)) {
    throw std::invalid_argument("with_periodic_check: every_s is not above 0");
  }
  if (check.stops.empty()) throw std::invalid_argument("with_periodic_check: no stop");
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < itinerary.visits.size(); ++i) {
    if (itinerary.visits[i].kind == VisitKind::point) places.push_back(i);
  }
  if (places.empty()) return itinerary;
  // ends[i]: when point i is done; a check behind point i stands between i and the next point.
  std::vector<double> ends;
  double now = 0.0;
  for (std::size_t i = places.front(), next = 0; next < places.size(); ++i) {
    now += itinerary.visits[i].travel_s + itinerary.visits[i].dwell_s;
    if (i == places[next]) {
      ends.push_back(now);
      ++next;
    }
  }
  const double inner = inner_s(travel, check);
  // Shortest path over the places where checks stand; place 0 is the opening, place i + 1 stands
  // behind point i, the last is the closing and costs nothing.
  const std::size_t n = places.size();
  std::vector<double> least(n + 1, kNoWay);
  std::vector<std::size_t> before(n + 1, 0);
  least[0] = 0.0;
  for (std::size_t to = 1; to <= n; ++to) {
    const double own = to == n ? 0.0 : detour_s(travel, itinerary, places[to - 1], check) + inner;
    for (std::size_t from = to; from-- > 0;) {
      const std::size_t points = to - from;
      const double lasts = ends[to - 1] - (from == 0 ? 0.0 : ends[from - 1]);
      if (points > 1 && (points > check.every_points || lasts > check.every_s)) break;
      if (least[from] + own < least[to]) {
        least[to] = least[from] + own;
        before[to] = from;
      }
    }
  }
  if (least[n] == kNoWay) {
    throw PreflightError("pre-run check: keep-outs bar the way to the " +
                         std::string(to_string(check.stops.back().kind)) + " between the points");
  }
  std::vector<std::size_t> chosen;
  for (std::size_t at = before[n]; at > 0; at = before[at]) chosen.push_back(places[at - 1]);
  std::reverse(chosen.begin(), chosen.end());
  return inserted(travel, itinerary, chosen, check);
}

}  // namespace gonio::acquisition
