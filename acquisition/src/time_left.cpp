#include "gonio/acquisition/time_left.h"

#include <algorithm>
#include <numeric>

#include "gonio/acquisition/resume.h"
#include "gonio/acquisition/trust_notes.h"
#include "gonio/devices/clock.h"
#include "session_parts.h"

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

/// Points of the last part with what they took, as TimeLeft is told of them while they are
/// measured: from the end of whatever was taken before.
std::vector<std::pair<int, double>> points_taken(const SessionReader& archive) {
  const SessionParts parts(archive);
  std::vector<std::pair<int, double>> taken;
  auto before = std::chrono::nanoseconds(-1);
  auto frame = archive.frames().begin();
  auto note = archive.notes().begin();
  for (const PointRecord& point : archive.points()) {
    for (; frame != archive.frames().end() && frame->exposure_start < point.finished_at; ++frame) {
      if (frame->point != point.point) before = frame->exposure_start + frame->exposure;
    }
    for (; note != archive.notes().end() && note->at < point.finished_at; ++note) {
      const bool homed = note->kind == kHomeDeltaNote || note->kind == kCameBackNote;
      if (homed) before = std::max(before, note->at);
    }
    const bool of_last_part = parts.of(point) + 1 == parts.count();
    if (of_last_part && point.outcome != PointOutcome::Failed && before.count() >= 0) {
      taken.emplace_back(point.point, devices::to_seconds(point.finished_at - before));
    }
    before = point.finished_at;
  }
  return taken;
}

/// SessionProgress::phase, by the latest frame; "point" for whatever is between the whites. A
/// visit to the white ends with a frame in the dark.
std::string latest_phase(const SessionReader& archive, bool points_taken, bool points_left) {
  const SessionParts parts(archive);
  if (archive.frames().empty() || parts.of(archive.frames().back()) + 1 < parts.count()) {
    return "home";
  }
  const auto lit =
      std::find_if(archive.frames().rbegin(), archive.frames().rend(),
                   [](const FrameRecord& frame) { return frame.kind != FrameKind::lamp_off; });
  const FrameKind kind = lit == archive.frames().rend() ? FrameKind::dark : lit->kind;
  const bool over = archive.frames().back().kind == FrameKind::lamp_off;
  if (points_taken) {
    if (kind != FrameKind::white || points_left) return "point";
    return over ? "park" : "closing white";
  }
  if (kind == FrameKind::dark) return "dark";
  return kind == FrameKind::white && !over ? "white" : "point";
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
  // What was measured before this part was checked then.
  const bool check_due = !points_left.empty() || taken_ > 0.0;
  double left =
      sum_from(check_due ? closing_.begin() : begin_of(closing_, VisitKind::white), closing_.end());
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

double seconds_left(const SessionReader& archive, const Itinerary& itinerary,
                    const MeasurementPlan& plan) {
  if (archive.finished()) return 0.0;
  const SessionPart part = part_to_resume(resume_state(archive));
  const std::set<int> left = points_left(part, plan.points.size());
  TimeLeft time(itinerary, plan);
  const auto taken = points_taken(archive);
  for (const auto& [point, seconds] : taken) time.took(point, seconds);
  // The latest frame is of the next point, or of the check or white before it.
  // Frames may all be lost, and their points not.
  const bool begun = !taken.empty() && !archive.frames().empty() &&
                     archive.frames().back().exposure_start > archive.points().back().finished_at;
  if (begun && !left.empty()) time.comes_to(*left.begin());
  return time.from(latest_phase(archive, !taken.empty(), !left.empty()), left);
}

}  // namespace gonio::acquisition
