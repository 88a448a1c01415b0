#include "gonio/acquisition/resume.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "session_parts.h"

namespace gonio::acquisition {
namespace {

/// Points that lost a frame. Of a row that cannot be read it is not known whose frame it was: it
/// may have been that of the frame before it or of the one after.
std::set<int> points_with_lost_frames(const SessionReader& archive) {
  std::set<int> points;
  const std::vector<FrameRecord>& frames = archive.frames();
  for (const SessionReader::LostFrames& lost : archive.lost_frames()) {
    if (lost.point) {
      points.insert(*lost.point);
      continue;
    }
    const auto after =
        std::upper_bound(frames.begin(), frames.end(), lost.last,
                         [](std::int64_t id, const FrameRecord& frame) { return id < frame.id; });
    if (after != frames.end()) points.insert(after->point);
    const auto before =
        std::lower_bound(frames.begin(), frames.end(), lost.first,
                         [](const FrameRecord& frame, std::int64_t id) { return frame.id < id; });
    if (before != frames.begin()) points.insert(std::prev(before)->point);
  }
  return points;
}

}  // namespace

ResumeState resume_state(const SessionReader& archive) {
  ResumeState state;
  state.finished = archive.finished();
  const SessionParts parts(archive);
  state.parts = static_cast<int>(parts.count());
  auto latest = std::chrono::nanoseconds(0);
  std::map<int, const PointRecord*> last;
  for (const PointRecord& point : archive.points()) {
    last[point.point] = &point;
    latest = std::max(latest, point.finished_at);
  }
  std::set<int> with_frames;
  for (const FrameRecord& frame : archive.frames()) {
    latest = std::max(latest, frame.exposure_start + frame.exposure);
    const auto point = last.find(frame.point);
    if (point != last.end() && parts.of(frame) == parts.of(*point->second)) {
      with_frames.insert(frame.point);
    }
  }
  for (const SessionNote& note : archive.notes()) {
    latest = std::max(latest, note.at);
  }
  const std::map<int, std::string> suspects = suspect_points(archive);
  auto compared = std::chrono::nanoseconds(-1);
  for (const SessionNote& note : archive.notes()) {
    if (note.kind == kHomeDeltaNote && compares_all_axes(note.text)) compared = note.at;
  }
  if (!archive.frames().empty()) state.last_joints = archive.frames().back().joints;
  const std::vector<SentinelVisit> sentinels = sentinel_visits(archive);
  if (!sentinels.empty()) state.sentinel = sentinels.front().reading;
  // A part is told by its times: nothing of the part before may have the time at which it begins.
  state.may_begin_at = latest + std::chrono::nanoseconds(1);
  state.decisions = decisions(archive);
  std::set<int> replaced;
  for (const LoggedDecision& logged : state.decisions) {
    for (const AddedPoint& added : logged.decision.added) {
      if (added.replaces) replaced.insert(*added.replaces);
    }
  }
  const std::set<int> damaged = points_with_lost_frames(archive);
  for (const auto& [index, point] : last) {
    if (point->outcome == PointOutcome::Failed && replaced.contains(index)) {
      state.done[index] = point->outcome;
    } else if (point->outcome == PointOutcome::Failed) {
      state.again.push_back(fmt::format("point {} had failed", index));
    } else if (damaged.contains(index) || !with_frames.contains(index)) {
      state.again.push_back(fmt::format("point {} has lost frames", index));
    } else if (const auto why = suspects.find(index); why != suspects.end()) {
      state.again.push_back(fmt::format("point {} is suspect ({})", index, why->second));
    } else {
      const bool unchecked = point->finished_at > compared;
      if (unchecked && archive.lost_rows()) {
        // A check that found something may have been among them.
        state.again.push_back(
            fmt::format("point {} was measured after the last check that is not lost", index));
        continue;
      }
      state.done[index] = point->outcome;
      if (unchecked) state.unchecked.push_back(index);
    }
  }
  return state;
}

SessionPart part_to_resume(const ResumeState& state) {
  SessionPart part;
  part.done = state.done;
  part.last_joints = state.last_joints;
  part.unchecked = state.unchecked;
  part.sentinel = state.sentinel;
  for (const LoggedDecision& logged : state.decisions) {
    for (const AddedPoint& added : logged.decision.added) {
      if (added.replaces) part.replaced.insert(*added.replaces);
    }
    part.dropped.insert(logged.decision.dropped.begin(), logged.decision.dropped.end());
    part.enough = part.enough || logged.decision.kind == Decision::Kind::enough;
  }
  return part;
}

}  // namespace gonio::acquisition
