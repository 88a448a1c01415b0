#pragma once

#include <vector>

#include "tour_problem.h"

namespace gonio::rig {

/// An open tour under change: nodes by position, with what is needed to price a change at once.
///
/// Position 0 is the start, 1..n the stops; behind the last there is the end, or nothing at no
/// cost. Costs of running the tour forwards and backwards are kept summed up, so that turning a
/// piece round is priced in constant time although a way and its way back differ.
class TourPath {
 public:
  TourPath(const TourProblem& problem, const std::vector<int>& nodes);

  int size() const { return static_cast<int>(nodes_.size()) - 1; }
  int node(int position) const { return nodes_[static_cast<std::size_t>(position)]; }
  int position(int stop) const { return positions_[static_cast<std::size_t>(stop)]; }
  double cost() const { return forward_.back() + steps_.back(); }
  /// Nodes without the start.
  std::vector<int> nodes() const { return {nodes_.begin() + 1, nodes_.end()}; }

  /// Cost from some node to the node at a position, behind the last to the end.
  double edge(int from_node, int to_position) const {
    return to_position > size() ? problem_->end_cost(from_node)
                                : problem_->cost(from_node, node(to_position));
  }
  /// Cost of the step from a position to the next.
  double step(int position) const { return steps_[static_cast<std::size_t>(position)]; }

  /// Change of cost by turning round the piece [first, last].
  double reversal_gain(int first, int last) const {
    return problem_->cost(node(first - 1), node(last)) + edge(node(first), last + 1) -
           step(first - 1) - step(last) + turned_minus_straight(first, last);
  }
  void reverse(int first, int last);

  /// Change of cost by taking out the piece [first, last] and closing the gap.
  double removal_gain(int first, int last) const {
    return edge(node(first - 1), last + 1) - step(first - 1) - step(last);
  }
  /// Change of cost by putting the piece [first, last], taken out, behind position `after`
  /// (outside the piece), turned round or not.
  double insertion_gain(int first, int last, int after, bool turned) const {
    const int head = turned ? node(last) : node(first);
    const int tail = turned ? node(first) : node(last);
    return problem_->cost(node(after), head) + edge(tail, after + 1) - step(after) +
           (turned ? turned_minus_straight(first, last) : 0.0);
  }
  void move(int first, int last, int after, bool turned);

  /// Change of cost by another pose of the stop at a position.
  double pose_gain(int position, int other_node) const;
  void set_pose(int position, int other_node);

 private:
  double turned_minus_straight(int first, int last) const {
    const auto f = static_cast<std::size_t>(first);
    const auto l = static_cast<std::size_t>(last);
    return (backward_[l] - backward_[f]) - (forward_[l] - forward_[f]);
  }
  void refresh(int first, int last);

  const TourProblem* problem_;  // not owned; a pointer so that paths can be assigned
  std::vector<int> nodes_;
  std::vector<int> positions_;
  std::vector<double> steps_;     // cost from position k to the next; of the last to the end
  std::vector<double> forward_;   // cost of positions 0..k
  std::vector<double> backward_;  // the same run from k to 0
};

}  // namespace gonio::rig
