#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "gonio/rig/kinematics.h"
#include "gonio/rig/paths.h"

namespace gonio::rig {

/// Time of a rest-to-rest move between two sets of joints with trapezoid speed per axis, settling
/// included (settle of axes that moved), approach overshoot included: a falling move by d takes
/// T(d + o), then T(o), each with its settling. Axes travel together unless the rig says otherwise:
/// first all to their targets or past them, then those that went past come back. Otherwise one
/// after another in the rig's order, each settling before the next starts.
///
/// Threads  const, may be shared.
class TravelModel {
 public:
  /// Throws std::invalid_argument for an invalid rig.
  explicit TravelModel(const RigDescription& rig);

  const RigDescription& rig() const { return rig_; }

  /// The direct move, whether or not keep-outs are in its way.
  double seconds(const Joints& from, const Joints& to) const;

  /// One axis alone, without settling.
  double axis_seconds(std::size_t axis, Angle from, Angle to) const;

  /// The move as it has to be made: direct, or with stops on the way around keep-outs.
  struct Route {
    std::vector<Joints> via;  ///< usually empty; the target is not listed
    double seconds = 0.0;
  };
  /// Nothing when no way is known that stays clear of keep-outs by `margin` (way_around()).
  std::optional<Route> route(const Joints& from, const Joints& to,
                             Angle margin = kPlanningMargin) const;

 private:
  RigDescription rig_;
};

/// Rest-to-rest time over a distance (either sign) at limited speed and acceleration; any unit of
/// length. 0 for no distance.
double rest_to_rest_seconds(double distance, double max_speed, double acceleration);

/// A stop of a tour: one of `alternatives` has to be visited.
struct TourStop {
  std::vector<PoseSolution> alternatives;
  double dwell_s = 0.0;  ///< spent there; the same for every order, so not part of the travel
};

struct TourVisit {
  std::size_t stop;         ///< index into the stops given
  std::size_t alternative;  ///< which of its poses
  double travel_s;          ///< from the pose before
  std::vector<Joints> via;  ///< stops to make on the way, around keep-outs; usually empty
};

/// A visiting order, from the given start, open at the end unless TourOptions::end says where.
struct Tour {
  std::vector<TourVisit> visits;
  double travel_s = 0.0;       ///< with the way from the last stop to the end, if there is one
  double lower_bound_s = 0.0;  ///< equals travel_s when exact
  bool exact = false;
  /// Stops left out because keep-outs bar the way to all their poses (Reason::PathBlocked).
  std::vector<std::size_t> blocked;
};

/// How much work shortest_tour() may do.
struct TourOptions {
  std::uint64_t seed = 1;
  /// Where the tour has to come to after its last stop; keep-outs must leave a way there by home.
  std::optional<Joints> end;
  int exact_up_to = 15;     ///< stops; above (or with very many poses) local search
  int kicks_per_stop = 80;  ///< of the local search, 2,000 to 60,000 kicks in all
};

/// Shortest tour over sets of alternatives: exact (Held-Karp) for up to 15 stops, otherwise
/// local search (2-opt, Or-opt, branch choice by shortest path, double-bridge kicks) with a
/// Held-Karp-ascent lower bound. Deterministic for a seed; work is bounded by iterations.
///
/// Cost     15 stops with 2 poses some 10 ms; on one core 200 stops about 1 s, 1000 stops 8 s.
///          Costs between up to 4,096 poses are kept (128 MiB), more are computed anew.
/// Throws   std::invalid_argument for a stop without alternatives.
/// Source   Held and Karp, "A Dynamic Programming Approach to Sequencing Problems", J. SIAM 10,
///          1962 (exact), and "The Traveling-Salesman Problem and Minimum Spanning Trees",
///          Operations Research 18, 1970 (bound).
Tour shortest_tour(const TravelModel& travel, const Joints& start,
                   const std::vector<TourStop>& stops, const TourOptions& options);
Tour shortest_tour(const TravelModel& travel, const Joints& start,
                   const std::vector<TourStop>& stops, std::uint64_t seed = 1);

}  // namespace gonio::rig
