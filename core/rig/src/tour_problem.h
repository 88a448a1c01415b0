#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gonio/rig/travel.h"

namespace gonio::rig {

/// A tour as numbers: nodes with costs between them. Node 0 is the start; every other node is one
/// pose of one stop, stops numbered from 0 without gaps.
class TourProblem {
 public:
  /// Leaves out poses and stops that keep-outs cut off; see blocked().
  TourProblem(const TravelModel& travel, const Joints& start, const std::vector<TourStop>& stops,
              const std::optional<Joints>& end = std::nullopt);

  int stop_count() const { return static_cast<int>(first_node_.size()) - 1; }
  int node_count() const { return static_cast<int>(joints_.size()); }

  /// Nodes of a stop: [first_node(stop), first_node(stop + 1)).
  int first_node(int stop) const { return first_node_[static_cast<std::size_t>(stop)]; }
  int stop_of(int node) const { return stop_of_[static_cast<std::size_t>(node)]; }
  const Joints& joints(int node) const { return joints_[static_cast<std::size_t>(node)]; }

  /// Seconds from one node to another; not symmetric in general.
  double cost(int from, int to) const {
    return table_.empty()
               ? computed_cost(from, to)
               : table_[static_cast<std::size_t>(from) * stride_ + static_cast<std::size_t>(to)];
  }

  /// Seconds from a node to where the tour has to end; 0 where it may end anywhere.
  double end_cost(int node) const {
    return end_costs_.empty() ? 0.0 : end_costs_[static_cast<std::size_t>(node)];
  }
  /// The least of them over the poses of a stop.
  double least_end_cost(int stop) const;

  /// Least cost between any poses of two stops, either way; -1 is the start.
  double least_cost(int stop, int other) const;

  /// Stops of the caller's list that cannot be reached.
  const std::vector<std::size_t>& blocked() const { return blocked_; }

  /// The caller's tour from a sequence of nodes, with times recomputed and ways around keep-outs.
  Tour tour_of(const std::vector<int>& nodes) const;

 private:
  double computed_cost(int from, int to) const;

  const TravelModel& travel_;
  std::vector<Joints> joints_;
  std::vector<int> stop_of_;
  std::vector<int> first_node_;
  std::vector<std::size_t> caller_stop_;         // by stop
  std::vector<std::size_t> caller_alternative_;  // by node
  std::vector<std::size_t> blocked_;
  std::size_t stride_ = 0;         // of the table: number of nodes
  std::vector<double> end_costs_;  // by node; empty for an open end
  std::vector<double> table_;      // empty when it would be too large
};

/// Cheapest choice of poses for stops in a given order: a layered shortest path. Nodes in order,
/// without the start.
std::vector<int> best_poses(const TourProblem& problem, const std::vector<int>& stops);

/// Cost of a sequence of nodes from the start to the end.
double path_cost(const TourProblem& problem, const std::vector<int>& nodes);

}  // namespace gonio::rig
