#include "gonio/rig/tour_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "tour_methods.h"

namespace gonio::rig {
namespace {

// Of Prim's algorithm, the second half of them being spared: about 0.2 s, whatever the number of
// stops.
constexpr double kEdgeVisits = 1e8;
constexpr int kMinRounds = 60;
constexpr int kMaxRounds = 3000;
constexpr double kFirstStep = 2.0;  // Polyak's factor
constexpr double kLastStep = 1e-4;
constexpr double kBoundRounding =
    1e-12;  // of the sums: the bound must not exceed a tour that meets it

/// Least costs between the start (0) and the stops (1..n), as a full matrix.
std::vector<double> distances_of(const TourProblem& problem) {
  const int size = problem.stop_count() + 1;
  std::vector<double> distances(static_cast<std::size_t>(size) * static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i) {
    for (int j = i + 1; j < size; ++j) {
      const double d = problem.least_cost(i - 1, j - 1);
      distances[static_cast<std::size_t>(i) * size + j] = d;
      distances[static_cast<std::size_t>(j) * size + i] = d;
    }
  }
  return distances;
}

struct OneTree {
  double cost = 0.0;
  std::vector<int> degrees;
};

/// Least tree over start and stops, closed through an extra node that stands between the end and
/// the start: the start has one more edge, and so has the stop with the least penalty and way to
/// the end (`end_distances`, of the stops from 1 on; of an open end 0).
OneTree one_tree(const std::vector<double>& distances, const std::vector<double>& end_distances,
                 const std::vector<double>& penalties) {
  const std::size_t size = penalties.size();
  OneTree tree{0.0, std::vector<int>(size, 0)};
  // Prim's algorithm. What is not yet in the tree stands together at the front, so that every round
  // looks at fewer: the far end of each edge, its length, and its near end.
  struct Outside {
    std::size_t node = 0;
    std::size_t parent = 0;
    double distance = std::numeric_limits<double>::infinity();
  };
  std::vector<Outside> outside(size - 1);
  for (std::size_t k = 1; k < size; ++k) outside[k - 1].node = k;
  std::size_t at = 0;
  for (std::size_t left = size - 1; left > 0; --left) {
    const double* row = &distances[at * size];
    std::size_t next = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < left; ++k) {
      Outside& each = outside[k];
      const double d = row[each.node] + penalties[at] + penalties[each.node];
      if (d < each.distance) {
        each.distance = d;
        each.parent = at;
      }
      if (each.distance < least) {
        least = each.distance;
        next = k;
      }
    }
    tree.cost += least;
    at = outside[next].node;
    ++tree.degrees[at];
    ++tree.degrees[outside[next].parent];
    outside[next] = outside[left - 1];
  }
  std::size_t end = 1;
  const auto end_cost = [&](std::size_t k) { return penalties[k] + end_distances[k]; };
  for (std::size_t k = 2; k < size; ++k) {
    if (end_cost(k) < end_cost(end)) end = k;
  }
  tree.cost += penalties[0] + end_cost(end);
  ++tree.degrees[0];
  ++tree.degrees[end];
  for (const double penalty : penalties) tree.cost -= 2.0 * penalty;
  return tree;
}

}  // namespace

double tour_lower_bound(const TourProblem& problem, double reachable_s) {
  const auto size = static_cast<std::size_t>(problem.stop_count()) + 1;
  if (size == 1) return 0.0;
  const std::vector<double> distances = distances_of(problem);
  std::vector<double> end_distances{0.0};
  for (int stop = 0; stop < problem.stop_count(); ++stop) {
    end_distances.push_back(problem.least_end_cost(stop));
  }
  const int rounds = static_cast<int>(std::clamp(kEdgeVisits / static_cast<double>(size * size),
                                                 1.0 * kMinRounds, 1.0 * kMaxRounds));
  std::vector<double> penalties(size, 0.0);
  std::vector<double> last_excess(size, 0.0);
  double best = 0.0;
  double step = kFirstStep;
  int stale = 0;
  for (int round = 0; round < rounds && step > kLastStep; ++round) {
    const OneTree tree = one_tree(distances, end_distances, penalties);
    if (tree.cost > best + 1e-6 * reachable_s) {
      best = tree.cost;
      stale = 0;
    } else if (++stale > std::max(5, rounds / 40)) {
      step *= 0.7;
      stale = 0;
    }
    best = std::max(best, tree.cost);
    double squares = 0.0;
    for (std::size_t k = 0; k < size; ++k) squares += std::pow(tree.degrees[k] - 2.0, 2);
    if (squares == 0.0) break;  // the tree is a tour: the bound is met
    const double length = step * std::max(reachable_s - tree.cost, 0.0) / squares;
    for (std::size_t k = 0; k < size; ++k) {
      // Part of the last direction damps the zigzag between neighbouring trees.
      const double excess = tree.degrees[k] - 2.0;
      penalties[k] += length * (0.7 * excess + 0.3 * last_excess[k]);
      last_excess[k] = excess;
    }
  }
  return best * (1.0 - kBoundRounding);
}

double travel_lower_bound(const TravelModel& travel, const Joints& start,
                          const std::vector<TourStop>& stops, double tour_s,
                          const std::optional<Joints>& end) {
  return tour_lower_bound(TourProblem(travel, start, stops, end), tour_s);
}

}  // namespace gonio::rig
