#include "tour_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace gonio::rig {
namespace {

constexpr std::size_t kMaxTableNodes = 4096;  // 128 MiB of costs; beyond they are computed anew

}  // namespace

TourProblem::TourProblem(const TravelModel& travel, const Joints& start,
                         const std::vector<TourStop>& stops, const std::optional<Joints>& end)
    : travel_(travel) {
  const Joints home = travel.rig().home();
  const bool free = travel.rig().keep_outs.empty();
  joints_.push_back(start);
  stop_of_.push_back(-1);
  caller_alternative_.push_back(0);
  for (std::size_t s = 0; s < stops.size(); ++s) {
    if (stops[s].alternatives.empty()) {
      throw std::invalid_argument("shortest_tour: stop " + std::to_string(s) + " has no pose");
    }
    const int first = node_count();
    for (std::size_t a = 0; a < stops[s].alternatives.size(); ++a) {
      const Joints& joints = stops[s].alternatives[a].joints;
      // What home can reach and be reached from, everything else can: by way of home.
      const bool usable = free || (travel.route(start, joints) && travel.route(home, joints) &&
                                   travel.route(joints, home));
      if (!usable) continue;
      joints_.push_back(joints);
      stop_of_.push_back(static_cast<int>(caller_stop_.size()));
      caller_alternative_.push_back(a);
    }
    if (node_count() == first) {
      blocked_.push_back(s);
    } else {
      first_node_.push_back(first);
      caller_stop_.push_back(s);
    }
  }
  first_node_.push_back(node_count());

  if (end) {
    for (const Joints& joints : joints_) {
      const auto route = travel.route(joints, *end);
      end_costs_.push_back(route ? route->seconds : std::numeric_limits<double>::infinity());
    }
  }

  const std::size_t nodes = joints_.size();
  if (nodes > kMaxTableNodes) return;
  std::vector<double> table(nodes * nodes, 0.0);
  for (std::size_t i = 0; i < nodes; ++i) {
    for (std::size_t j = 1; j < nodes; ++j) {
      if (stop_of_[i] == stop_of_[j]) continue;
      table[i * nodes + j] = computed_cost(static_cast<int>(i), static_cast<int>(j));
    }
  }
  stride_ = nodes;
  table_ = std::move(table);
}

double TourProblem::computed_cost(int from, int to) const {
  if (travel_.rig().keep_outs.empty()) return travel_.seconds(joints(from), joints(to));
  const auto route = travel_.route(joints(from), joints(to));
  return route ? route->seconds : std::numeric_limits<double>::infinity();
}

double TourProblem::least_end_cost(int stop) const {
  double least = std::numeric_limits<double>::infinity();
  for (int node = first_node(stop); node < first_node(stop + 1); ++node) {
    least = std::min(least, end_cost(node));
  }
  return least;
}

double TourProblem::least_cost(int stop, int other) const {
  const auto begin = [&](int s) { return s < 0 ? 0 : first_node(s); };
  const auto end = [&](int s) { return s < 0 ? 1 : first_node(s + 1); };
  double least = std::numeric_limits<double>::infinity();
  for (int a = begin(stop); a < end(stop); ++a) {
    for (int b = begin(other); b < end(other); ++b) {
      if (b != 0) least = std::min(least, cost(a, b));
      if (a != 0) least = std::min(least, cost(b, a));
    }
  }
  return least;
}

Tour TourProblem::tour_of(const std::vector<int>& nodes) const {
  Tour tour;
  tour.blocked = blocked_;
  int at = 0;
  for (const int node : nodes) {
    const auto route = travel_.route(joints(at), joints(node));
    if (!route) throw std::logic_error("shortest_tour: a chosen way is barred");
    tour.visits.push_back({caller_stop_[static_cast<std::size_t>(stop_of(node))],
                           caller_alternative_[static_cast<std::size_t>(node)], route->seconds,
                           route->via});
    tour.travel_s += route->seconds;
    at = node;
  }
  tour.travel_s += end_cost(at);
  return tour;
}

std::vector<int> best_poses(const TourProblem& problem, const std::vector<int>& stops) {
  std::vector<double> cost{0.0};
  std::vector<int> layer{0};
  std::vector<std::vector<int>> came_from;  // per layer: index into the layer before
  for (const int stop : stops) {
    std::vector<double> next_cost;
    std::vector<int> next_layer;
    std::vector<int> from;
    for (int node = problem.first_node(stop); node < problem.first_node(stop + 1); ++node) {
      double best = std::numeric_limits<double>::infinity();
      int best_from = 0;
      for (std::size_t k = 0; k < layer.size(); ++k) {
        const double c = cost[k] + problem.cost(layer[k], node);
        if (c < best) {
          best = c;
          best_from = static_cast<int>(k);
        }
      }
      next_layer.push_back(node);
      next_cost.push_back(best);
      from.push_back(best_from);
    }
    cost = std::move(next_cost);
    layer = std::move(next_layer);
    came_from.push_back(std::move(from));
  }
  for (std::size_t last = 0; last < layer.size(); ++last)
    cost[last] += problem.end_cost(layer[last]);
  std::vector<int> nodes(stops.size());
  auto k = static_cast<std::size_t>(std::min_element(cost.begin(), cost.end()) - cost.begin());
  for (std::size_t i = stops.size(); i-- > 0;) {
    nodes[i] = problem.first_node(stops[i]) + static_cast<int>(k);
    k = static_cast<std::size_t>(came_from[i][k]);
  }
  return nodes;
}

double path_cost(const TourProblem& problem, const std::vector<int>& nodes) {
  double sum = 0.0;
  int at = 0;
  for (const int node : nodes) {
    sum += problem.cost(at, node);
    at = node;
  }
  return sum + problem.end_cost(at);
}

}  // namespace gonio::rig
