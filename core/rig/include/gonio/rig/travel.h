#pragma once

#include <chrono>
#include <vector>

#include "gonio/rig/kinematics.h"

namespace gonio::rig {

/// Time of a rest-to-rest move between two sets of joints with trapezoid speed per axis, settling
/// included (settle of axes that moved), approach overshoot included.
/// Axes travel together unless the rig says otherwise.
class TravelModel {
 public:
  explicit TravelModel(const RigDescription& rig);
  double seconds(const Joints& from, const Joints& to) const;
  /// One axis alone, without settling.
  double axis_seconds(std::size_t axis, Angle from, Angle to) const;

 private:
  std::vector<Axis> axes_;
  bool simultaneous_;
};

/// A stop of a tour: one of `alternatives` has to be visited.
struct TourStop {
  std::vector<PoseSolution> alternatives;
  double dwell_s = 0.0;
};

struct TourVisit {
  std::size_t stop;         ///< index into the stops given
  std::size_t alternative;  ///< which of its poses
  double travel_s;          ///< from the pose before
};

/// A visiting order, from the given start, open at the end.
struct Tour {
  std::vector<TourVisit> visits;
  double travel_s = 0.0;
  double lower_bound_s = 0.0;  ///< equals travel_s when exact
  bool exact = false;
};

/// Shortest open tour over sets of alternatives: exact (Held-Karp) for up to 15 stops, otherwise
/// local search (2-opt, Or-opt, branch choice by shortest path, double-bridge kicks) with a
/// Held-Karp-ascent lower bound. Deterministic for a seed; work is bounded by iterations.
Tour shortest_tour(const TravelModel& travel, const Joints& start,
                   const std::vector<TourStop>& stops, std::uint64_t seed = 1);

}  // namespace gonio::rig
