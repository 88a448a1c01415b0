#include <algorithm>
#include <limits>

#include "tour_methods.h"

namespace gonio::rig {
namespace {

constexpr int kMaxStops = 15;
constexpr std::size_t kMaxStates = std::size_t{1} << 23;  // 8 + 4 bytes each

}  // namespace

bool exact_is_affordable(const TourProblem& problem) {
  const int n = problem.stop_count();
  return n <= kMaxStops &&
         (std::size_t{1} << n) * static_cast<std::size_t>(problem.node_count()) <= kMaxStates;
}

std::vector<int> exact_tour(const TourProblem& problem) {
  const int n = problem.stop_count();
  const int nodes = problem.node_count();
  if (n == 0) return {};
  const std::size_t sets = std::size_t{1} << n;
  const auto state = [&](std::size_t set, int last) {
    return set * static_cast<std::size_t>(nodes) + static_cast<std::size_t>(last);
  };
  std::vector<double> best(sets * static_cast<std::size_t>(nodes),
                           std::numeric_limits<double>::infinity());
  std::vector<std::int32_t> before(best.size(), 0);
  best[state(0, 0)] = 0.0;
  // Sets in rising order: adding a stop always leads to a later set.
  for (std::size_t set = 0; set + 1 < sets; ++set) {
    for (int last = 0; last < nodes; ++last) {
      const double cost = best[state(set, last)];
      if (cost == std::numeric_limits<double>::infinity()) continue;
      for (int stop = 0; stop < n; ++stop) {
        const std::size_t bit = std::size_t{1} << stop;
        if (set & bit) continue;
        for (int node = problem.first_node(stop); node < problem.first_node(stop + 1); ++node) {
          const std::size_t next = state(set | bit, node);
          const double c = cost + problem.cost(last, node);
          if (c < best[next]) {
            best[next] = c;
            before[next] = last;
          }
        }
      }
    }
  }
  std::size_t set = sets - 1;
  for (int node = 0; node < nodes; ++node) best[state(set, node)] += problem.end_cost(node);
  const auto row = best.begin() + static_cast<std::ptrdiff_t>(state(set, 0));
  int last = static_cast<int>(std::min_element(row, row + nodes) - row);
  std::vector<int> tour(static_cast<std::size_t>(n));
  for (std::size_t i = tour.size(); i-- > 0;) {
    tour[i] = last;
    const int previous = before[state(set, last)];
    set &= ~(std::size_t{1} << problem.stop_of(last));
    last = previous;
  }
  return tour;
}

}  // namespace gonio::rig
