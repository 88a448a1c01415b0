#pragma once

#include <cstdint>
#include <functional>
#include <stop_token>
#include <vector>

#include "candidate_gate.h"
#include "gonio/design/condition_search.h"

namespace gonio::design {

/// A set of directions that grows, and what one more would make of it.
class GrowingSet {
 public:
  GrowingSet() = default;
  GrowingSet(const GrowingSet&) = delete;
  GrowingSet& operator=(const GrowingSet&) = delete;
  virtual ~GrowingSet() = default;

  /// What is minimised, if this cell joined.
  virtual double value_with(std::uint32_t cell) const = 0;
  virtual void add(std::uint32_t cell) = 0;
};

/// The search of Nielsen et al. 2015 for whatever `set` measures: directions join one after
/// another, the best of some random ones moved over the lattice in steps of 3 and then 1 while the
/// value falls. `first` chooses the first direction; empty: like the others. Once asked to stop the
/// rest is single random cells: a whole set, only a poor one.
///
/// `show`   From the value of a set to what progress tells.
/// Returns  The cells, and whether it came to its end.
/// Throws   std::invalid_argument for too few usable candidates.
Design published_search(GrowingSet& set, CandidateGate& gate, const ConditionSearchOptions& options,
                        const char* stream, const std::function<std::uint32_t()>& first,
                        const std::function<double(double)>& show, const ProgressCallback& progress,
                        const std::stop_token& stop);

/// Throws std::invalid_argument unless there is one row per basis cell and a component.
void require_lattice_rows(const basis::RowMajorMatrixXf& rows);

}  // namespace gonio::design
