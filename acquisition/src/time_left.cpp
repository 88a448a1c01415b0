#include "time_left.h"

#include <algorithm>
#include <numeric>

namespace gonio::acquisition {
namespace {

/// So many points as foreseen count beside those measured: the first say little about the rest.
constexpr double kPriorPoints = 3.0;

double seconds_of(const PlannedVisit& visit) { return visit.travel_s + visit.dwell_s; }

double sum_from(std::vector<PlannedVisit>::const_iterator first,
                std::vector<PlannedVisit>::const_iterator last) {
  return std::accumulate(first, last, 0.0, [](double sum, const PlannedVisit& visit) {
    return sum + seconds_of(visit);
  });
}

}  // namespace

TimeLeft::TimeLeft(const Itinerary& itinerary, const MeasurementPlan& plan) {
  std::vector<PlannedVisit> since_point;
  for (const PlannedVisit& visit : itinerary.visits) {
    if (!visit.point) {
      since_point.push_back(visit);
      continue;
    }
    const auto index = static_cast<int>(*visit.point);
    if (points_.empty()) {
      opening_ = since_point;
    } else {
      before_[index] = sum_from(since_point.begin(), since_point.end());
    }
    since_point.clear();
    points_[index] = seconds_of(visit);
    mean_ += seconds_of(visit) / static_cast<double>(plan.points.size());
  }
  closing_ = std::move(since_point);
}

void TimeLeft::took(int point, double seconds) {
  foreseen_ += point_s(point);
  taken_ += seconds;
}

double TimeLeft::from(const std::string& phase, const std::set<int>& points_left) const {
  const auto begin_of = [](const std::vector<PlannedVisit>& visits, VisitKind kind) {
    return std::find_if(visits.begin(), visits.end(),
                        [kind](const PlannedVisit& visit) { return visit.kind == kind; });
  };
  if (phase == "park") {
    return sum_from(begin_of(closing_, VisitKind::park), closing_.end());
  }
  if (phase == "closing white") {
    return sum_from(begin_of(closing_, VisitKind::white), closing_.end());
  }
  double left = sum_from(closing_.begin(), closing_.end());
  for (const VisitKind kind : {VisitKind::home, VisitKind::dark, VisitKind::white}) {
    // Whites between points have the same name: by then some points have been measured.
    if (phase != to_string(kind) || taken_ > 0.0) continue;
    left += sum_from(begin_of(opening_, kind), opening_.end());
  }
  const double prior = kPriorPoints * mean_;
  const double pace = prior > 0.0 ? (taken_ + prior) / (foreseen_ + prior) : 1.0;
  for (const int point : points_left) {
    const auto before = before_.find(point);
    left += pace * point_s(point) + (before == before_.end() ? 0.0 : before->second);
  }
  return left;
}

double TimeLeft::point_s(int point) const {
  const auto found = points_.find(point);
  return found == points_.end() ? mean_ : found->second;
}

}  // namespace gonio::acquisition
