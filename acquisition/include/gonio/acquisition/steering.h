#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "gonio/acquisition/decisions.h"
#include "gonio/acquisition/forecast.h"
#include "gonio/acquisition/measurement_plan.h"
#include "gonio/acquisition/session_archive.h"

namespace gonio::acquisition {

/// How far a session is between two points.
struct SessionSoFar {
  const MeasurementPlan& plan;  ///< with the points that were added
  const std::map<int, PointOutcome>& done;
  std::vector<int> left;  ///< points that are to be measured yet, in their order
  /// Why a pose cannot stand behind all others: limits, keep-outs on the way to it and to the
  /// white, a direction that the plan has already. Empty: it can.
  std::function<std::string(const PlannedPoint&)> refusal;
};

/// Says what a session measures besides its plan, or that it is enough: the closed loop.
///
/// run_session() asks it when a part begins and after each point, whatever became of that; all that
/// is acknowledged can be read from the archive meanwhile. What it answers is checked and noted
/// (kDecisionNote) before anything moves for it. So that an interrupted session decides as one that
/// was not, and so that a log can be replayed, an answer is to follow from what the archive holds,
/// its decisions included, and from nothing else.
///
/// Threads  Asked on the session's thread, which waits.
/// Errors   What it throws ends the session, which then can be resumed. FolderMoved does in its
///          place, and in that of an answer, when the archive's folder was moved or replaced.
class Steering {
 public:
  virtual ~Steering() = default;
  Steering(const Steering&) = delete;
  Steering& operator=(const Steering&) = delete;

  /// Nothing: go on as planned. A point that ended as Failed and that a decision replaces is not
  /// tried again.
  virtual std::optional<Decision> decide(const SessionSoFar& now) = 0;

  /// What the sample is like by what was measured when it was asked last, for the first exposures
  /// of the points that follow; the number of a point does not matter to it. Nothing: not known
  /// yet.
  virtual std::optional<ExpectedSample> expected() const { return std::nullopt; }

 protected:
  Steering() = default;
};

/// Points as a plan has them, of decisions of before: behind the plan's own.
/// Throws std::invalid_argument when they do not count on from the plan's.
void add_points(const Decision& decision, MeasurementPlan& plan);

/// SessionSoFar::refusal of a session on this rig, whose axes come from the plan's last point; the
/// white is at white_joints().
std::string why_not_behind(const rig::RigDescription& rig, const MeasurementPlan& plan,
                           const PlannedPoint& point);

}  // namespace gonio::acquisition
