#include "point_schedule.h"

#include <algorithm>

#include "gonio/acquisition/steering.h"

namespace gonio::acquisition {

std::set<int> points_left(const SessionPart& part, std::size_t planned) {
  std::set<int> left;
  for (int point = 0; point < static_cast<int>(planned); ++point) {
    if (!part.done.contains(point) && !part.dropped.contains(point)) left.insert(point);
  }
  return left;
}

PointSchedule::PointSchedule(const MeasurementPlan& plan, const SessionPart& part,
                             const Itinerary& itinerary)
    : plan_(plan), done_(part.done), replaced_(part.replaced), dropped_(part.dropped) {
  for (const int point : points_left(part, plan.points.size())) take_again(point);
  std::set<VisitKind> since_point;
  bool among_points = false;
  for (const PlannedVisit& visit : itinerary.visits) {
    if (!visit.point) {
      since_point.insert(visit.kind);
      continue;
    }
    const auto index = static_cast<int>(*visit.point);
    if (among_points && since_point.contains(VisitKind::white)) white_before_.insert(index);
    if (among_points && since_point.contains(VisitKind::sentinel)) check_before_.insert(index);
    since_point.clear();
    among_points = true;
  }
}

int PointSchedule::planned() const {
  return static_cast<int>(plan_.points.size() - dropped_.size());
}

int PointSchedule::measured() const {
  return static_cast<int>(std::count_if(done_.begin(), done_.end(), [](const auto& point) {
    return point.second == PointOutcome::Measured;
  }));
}

bool PointSchedule::is_complete() const {
  for (int i = 0; i < static_cast<int>(plan_.points.size()); ++i) {
    if (is_settled(i)) continue;
    const auto found = done_.find(i);
    if (found == done_.end() || found->second != PointOutcome::Measured) return false;
  }
  return true;
}

void PointSchedule::acknowledge(int point, PointOutcome outcome) {
  done_[point] = outcome;
  failed_.erase(point);
  left_.erase(point);
}

void PointSchedule::take_again(int point) {
  done_.erase(point);
  left_.insert(point);
}

void PointSchedule::take_again_once(int point) {
  if (taken_again_.insert(point).second) take_again(point);
}

void PointSchedule::take_failed_again() {
  for (const int point : failed()) take_again_once(point);
}

std::vector<int> PointSchedule::failed() const {
  std::vector<int> points;
  for (const int point : failed_) {
    if (!is_settled(point)) points.push_back(point);
  }
  return points;
}

void PointSchedule::apply(const Decision& decision) {
  const std::size_t before = plan_.points.size();
  add_points(decision, plan_);
  for (std::size_t i = before; i < plan_.points.size(); ++i) take_again(static_cast<int>(i));
  for (const AddedPoint& added : decision.added) {
    if (added.replaces) replaced_.insert(*added.replaces);
  }
  for (const int point : decision.dropped) {
    dropped_.insert(point);
    left_.erase(point);
  }
}

}  // namespace gonio::acquisition
