#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "gonio/acquisition/itinerary.h"
#include "gonio/acquisition/measurement_plan.h"
#include "gonio/acquisition/session_archive.h"

namespace gonio::acquisition {

/// How much longer a session takes: its itinerary as foreseen, points by what those measured took.
///
/// Unit     Seconds.
/// Threads  One.
class TimeLeft {
 public:
  /// `itinerary`: with the time of every visit (PlannedVisit::dwell_s), as preflight() leaves it
  /// when something is expected; otherwise only points and ways count.
  TimeLeft(const Itinerary& itinerary, const MeasurementPlan& plan);

  /// A point took so long, way included.
  void took(int point, double seconds);

  /// What stands before this point is behind, or is done now.
  void comes_to(int point) { before_.erase(point); }

  /// From the beginning of a phase (SessionProgress::phase) to the end of the session, with these
  /// points to be measured yet. A point that the itinerary does not have counts as the mean of
  /// those it has.
  double from(const std::string& phase, const std::set<int>& points_left) const;

 private:
  double point_s(int point) const;

  std::vector<PlannedVisit> opening_;  ///< before the first point
  std::vector<PlannedVisit> closing_;  ///< behind the last
  std::map<int, double> points_;
  std::map<int, double> before_;  ///< checks and whites that stand before a point
  double mean_ = 0.0;             ///< of points
  double foreseen_ = 0.0;         ///< of those that were measured
  double taken_ = 0.0;            ///< by those
};

/// The same of a session that another process measures, by what its journal holds: from the
/// beginning of what it did last, at the pace of the points of this part.
///
/// `plan`    With the points that decisions have added (ResumeState::decisions) behind its own.
/// Returns   Seconds, from the latest row of the journal on; 0 for a finished session.
/// Throws    DataFormatError as resume_state().
double seconds_left(const SessionReader& archive, const Itinerary& itinerary,
                    const MeasurementPlan& plan);

}  // namespace gonio::acquisition
