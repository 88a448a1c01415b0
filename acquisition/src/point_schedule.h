#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "gonio/acquisition/decisions.h"
#include "gonio/acquisition/itinerary.h"
#include "gonio/acquisition/session.h"

namespace gonio::acquisition {

/// Which points of a session are done, left, failed, added or left out, and before which of them a
/// check or a white stands.
///
/// Threads  One.
class PointSchedule {
 public:
  /// `itinerary`: where checks and whites stand between the points.
  PointSchedule(const MeasurementPlan& plan, const SessionPart& part, const Itinerary& itinerary);

  /// With what was added.
  const MeasurementPlan& plan() const { return plan_; }
  const std::map<int, PointOutcome>& done() const { return done_; }
  /// To be measured yet, in their order.
  const std::set<int>& left() const { return left_; }
  int planned() const;  ///< points, with those added and without those dropped
  int measured() const;
  /// Every point was measured, or a decision replaced or dropped it.
  bool is_complete() const;

  /// The point's row is in the archive.
  void acknowledge(int point, PointOutcome outcome);
  /// Once more, whatever became of it.
  void take_again(int point);
  /// Once more, unless that was asked for before: what stays bad is not measured for ever.
  void take_again_once(int point);
  /// A device failed at it: it is measured again in the end.
  void fail(int point) { failed_.insert(point); }
  /// All that failed and that no decision replaced, once more.
  void take_failed_again();
  /// That failed again.
  std::vector<int> failed() const;
  /// Points come behind the others, or are left out. Throws std::invalid_argument as add_points().
  void apply(const Decision& decision);

  /// Whether the itinerary has a check, or a white, before this point; true once.
  bool check_stands_before(int point) { return check_before_.erase(point) > 0; }
  bool white_stands_before(int point) { return white_before_.erase(point) > 0; }

 private:
  bool is_settled(int point) const { return replaced_.contains(point) || dropped_.contains(point); }

  MeasurementPlan plan_;
  std::map<int, PointOutcome> done_;
  std::set<int> left_;
  std::set<int> replaced_;
  std::set<int> dropped_;
  std::set<int> failed_;       ///< of `done_`, for a device's sake
  std::set<int> taken_again_;  ///< suspects and failed ones of this run
  std::set<int> check_before_;
  std::set<int> white_before_;
};

}  // namespace gonio::acquisition
