#include "tour_path.h"

#include <algorithm>

namespace gonio::rig {

TourPath::TourPath(const TourProblem& problem, const std::vector<int>& nodes)
    : problem_(&problem),
      nodes_{0},
      positions_(static_cast<std::size_t>(problem.stop_count()), 0),
      steps_(nodes.size() + 1, 0.0),
      forward_(nodes.size() + 1, 0.0),
      backward_(nodes.size() + 1, 0.0) {
  nodes_.insert(nodes_.end(), nodes.begin(), nodes.end());
  steps_.back() = problem.end_cost(nodes_.back());
  if (size() > 0) refresh(1, size());
}

/// Recomputes positions and sums after the nodes at [first, last] have changed.
void TourPath::refresh(int first, int last) {
  const auto end = static_cast<std::size_t>(std::min(last + 1, size()));
  const double forward_before = forward_[end];
  const double backward_before = backward_[end];
  for (auto k = static_cast<std::size_t>(first); k <= end; ++k) {
    positions_[static_cast<std::size_t>(problem_->stop_of(nodes_[k]))] = static_cast<int>(k);
    steps_[k - 1] = problem_->cost(nodes_[k - 1], nodes_[k]);
    forward_[k] = forward_[k - 1] + steps_[k - 1];
    // Nothing ever runs back into the start, so that way has no price.
    backward_[k] = backward_[k - 1] + (k == 1 ? 0.0 : problem_->cost(nodes_[k], nodes_[k - 1]));
  }
  steps_.back() = problem_->end_cost(nodes_.back());
  const double forward_shift = forward_[end] - forward_before;
  const double backward_shift = backward_[end] - backward_before;
  for (std::size_t k = end + 1; k < nodes_.size(); ++k) {
    forward_[k] += forward_shift;
    backward_[k] += backward_shift;
  }
}

void TourPath::reverse(int first, int last) {
  std::reverse(nodes_.begin() + first, nodes_.begin() + last + 1);
  refresh(first, last);
}

void TourPath::move(int first, int last, int after, bool turned) {
  if (turned) std::reverse(nodes_.begin() + first, nodes_.begin() + last + 1);
  if (after > last) {
    std::rotate(nodes_.begin() + first, nodes_.begin() + last + 1, nodes_.begin() + after + 1);
    refresh(first, after);
  } else {
    std::rotate(nodes_.begin() + after + 1, nodes_.begin() + first, nodes_.begin() + last + 1);
    refresh(after + 1, last);
  }
}

double TourPath::pose_gain(int position, int other_node) const {
  return problem_->cost(node(position - 1), other_node) + edge(other_node, position + 1) -
         step(position - 1) - step(position);
}

void TourPath::set_pose(int position, int other_node) {
  nodes_[static_cast<std::size_t>(position)] = other_node;
  refresh(position, position);
}

}  // namespace gonio::rig
