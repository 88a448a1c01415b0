#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

namespace gonio::design {

/// How far a search is; sent from the calling thread, some tens of times per second at most.
struct SearchProgress {
  double fraction = 0.0;  ///< estimate in [0, 1], never falls
  double best = 0.0;      ///< criterion of the best whole design so far
};
using ProgressCallback = std::function<void(const SearchProgress&)>;

/// A chosen set of directions.
struct Design {
  std::vector<std::uint32_t> cells;  ///< basis cells, in the order they were chosen; no repeats
  double value = 0.0;                ///< criterion (or condition number), from scratch in double;
                                     ///< with penalties: times exp(their sum), of a logarithm: plus
  bool finished = true;              ///< false: stopped on request, the best so far
  int starts = 0;                    ///< that ran to their end
  int exchanges = 0;                 ///< swaps that led to it
};

}  // namespace gonio::design
