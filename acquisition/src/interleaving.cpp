#include <algorithm>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>

#include "gonio/acquisition/itinerary.h"

namespace gonio::acquisition {
namespace {

constexpr double kNoWay = std::numeric_limits<double>::infinity();

double seconds_between(const rig::TravelModel& travel, const rig::PoseSolution& from,
                       const rig::PoseSolution& to) {
  const auto route = travel.route(from.joints, to.joints);
  return route ? route->seconds : kNoWay;
}

/// What it costs to go by way of `pose` on the way from the visit at `place` to the next.
double detour_s(const rig::TravelModel& travel, const Itinerary& itinerary, std::size_t place,
                const rig::PoseSolution& pose) {
  const PlannedVisit& after = itinerary.visits[place + 1];
  return seconds_between(travel, itinerary.visits[place].pose, pose) +
         seconds_between(travel, pose, after.pose) - after.travel_s;
}

/// Places among the visits where points are measured, with or without second halves of pairs.
std::vector<std::size_t> places_of(const Itinerary& itinerary, bool second_halves) {
  std::vector<std::size_t> places;
  for (std::size_t i = 0; i < itinerary.visits.size(); ++i) {
    const VisitKind kind = itinerary.visits[i].kind;
    const bool second = kind == VisitKind::repeat || kind == VisitKind::reciprocity;
    if (kind == VisitKind::point || (second && second_halves)) places.push_back(i);
  }
  return places;
}

struct Insertion {
  std::size_t place = 0;  ///< behind the visit there
  PlannedVisit visit;
};

/// With all insertions made, ways and times found anew around them.
Itinerary inserted(const rig::TravelModel& travel, const Itinerary& itinerary,
                   std::vector<Insertion> insertions) {
  std::stable_sort(insertions.begin(), insertions.end(),
                   [](const Insertion& a, const Insertion& b) { return a.place < b.place; });
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
  std::size_t next = 0;
  bool was_inserted = false;
  for (std::size_t i = 0; i < itinerary.visits.size(); ++i) {
    add(itinerary.visits[i], was_inserted);
    was_inserted = false;
    for (; next < insertions.size() && insertions[next].place == i; ++next) {
      add(std::move(insertions[next].visit), true);
      was_inserted = true;
    }
  }
  return result;
}

/// The best second half for one of the points first..last - 1 of the session.
struct Pair {
  double detour_s = kNoWay;
  Insertion insertion;
};

/// Poses that may be a point's second half; empty when it has none.
using SecondHalves = std::function<std::vector<rig::PoseSolution>(std::size_t point)>;

/// Tries the points of one stretch with every place at least `apart` points later.
Pair best_pair(const rig::TravelModel& travel, const Itinerary& itinerary,
               const std::vector<std::size_t>& places, std::size_t first, std::size_t last,
               std::size_t apart, VisitKind kind, const SecondHalves& second_halves) {
  Pair best;
  for (std::size_t i = first; i < last; ++i) {
    const PlannedVisit& visit = itinerary.visits[places[i]];
    for (const rig::PoseSolution& pose : second_halves(*visit.point)) {
      for (std::size_t later = i + apart; later < places.size(); ++later) {
        const double detour = detour_s(travel, itinerary, places[later], pose);
        if (detour >= best.detour_s) continue;
        best = {detour, {places[later], {kind, visit.point, pose, {}, 0.0, visit.dwell_s}}};
      }
    }
  }
  return best;
}

void add_pairs(const rig::TravelModel& travel, const Itinerary& itinerary,
               const std::vector<std::size_t>& places, std::size_t pairs, std::size_t range,
               std::size_t apart, VisitKind kind, const SecondHalves& second_halves,
               std::vector<Insertion>& insertions) {
  pairs = std::min(pairs, range);
  for (std::size_t k = 0; k < pairs; ++k) {
    Pair best = best_pair(travel, itinerary, places, k * range / pairs, (k + 1) * range / pairs,
                          apart, kind, second_halves);
    if (best.detour_s < kNoWay) insertions.push_back(std::move(best.insertion));
  }
}

bool is_exchanged(const rig::PoseSolution& pose) {
  return pose.branch == rig::Branch::C || pose.branch == rig::Branch::D;
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
  const std::vector<std::size_t> places = places_of(itinerary, true);
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
  // Shortest path over the places where checks stand; place 0 is the opening, place i + 1 stands
  // behind point i, the last is the closing and costs nothing.
  const std::size_t n = places.size();
  std::vector<double> least(n + 1, kNoWay);
  std::vector<std::size_t> before(n + 1, 0);
  least[0] = 0.0;
  for (std::size_t to = 1; to <= n; ++to) {
    const double own =
        to == n ? 0.0 : detour_s(travel, itinerary, places[to - 1], check.pose) + check.dwell_s;
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
                         std::string(to_string(check.kind)) + " between the points");
  }
  std::vector<Insertion> insertions;
  for (std::size_t at = before[n]; at > 0; at = before[at]) {
    insertions.push_back(
        {places[at - 1], {check.kind, std::nullopt, check.pose, {}, 0.0, check.dwell_s}});
  }
  return inserted(travel, itinerary, std::move(insertions));
}

Itinerary with_pairs(const rig::TravelModel& travel, const Itinerary& itinerary,
                     const rig::Inverse& inverse, const MeasurementPlan& plan,
                     const PairOptions& options) {
  const std::vector<std::size_t> places = places_of(itinerary, false);
  std::vector<Insertion> insertions;
  const auto same = [&](std::size_t point) {
    return std::vector<rig::PoseSolution>{plan.points.at(point).pose};
  };
  const auto exchanged = [&](std::size_t point) {
    const PlannedPoint& planned = plan.points.at(point);
    std::vector<rig::PoseSolution> poses = inverse.solve(planned.direction).poses;
    std::erase_if(poses, [&](const rig::PoseSolution& pose) {
      return is_exchanged(pose) == is_exchanged(planned.pose) ||
             pose.mirrored != planned.pose.mirrored;
    });
    return poses;
  };
  const std::size_t half = places.size() / 2;
  add_pairs(travel, itinerary, places, options.repeats, half, half, VisitKind::repeat, same,
            insertions);
  add_pairs(travel, itinerary, places, options.reciprocals, places.size(), 0,
            VisitKind::reciprocity, exchanged, insertions);
  return inserted(travel, itinerary, std::move(insertions));
}

}  // namespace gonio::acquisition
