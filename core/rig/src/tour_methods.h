#pragma once

#include <vector>

#include "tour_problem.h"

namespace gonio::rig {

/// Whether the exact method fits into time and memory: at most 15 stops, 2^23 states.
bool exact_is_affordable(const TourProblem& problem);

/// Optimal nodes by dynamic programming over (visited stops, last node).
/// Source   Held and Karp, "A Dynamic Programming Approach to Sequencing Problems", J. SIAM 10,
///          1962.
std::vector<int> exact_tour(const TourProblem& problem);

/// Good nodes by iterated local search from several constructions.
std::vector<int> searched_tour(const TourProblem& problem, const TourOptions& options);

/// A time no tour can beat: 1-trees over least costs between stops, with node penalties raised by
/// subgradient steps. `reachable_s` is the cost of a known tour.
/// Source   Held and Karp, "The Traveling-Salesman Problem and Minimum Spanning Trees",
///          Operations Research 18, 1970.
double tour_lower_bound(const TourProblem& problem, double reachable_s);

}  // namespace gonio::rig
