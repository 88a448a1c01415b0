#include "published_search.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>

#include "gonio/random/stream.h"
#include "lattice_moves.h"

namespace gonio::design {
namespace {

constexpr std::array<int, 2> kSteps = {3, 1};

}  // namespace

void ConditionSearchOptions::validate() const {
  if (sample_count < 1) {
    throw std::invalid_argument("design: sample_count is " + std::to_string(sample_count) +
                                ", expected at least 1");
  }
  if (random_cells < 1) {
    throw std::invalid_argument("design: random_cells is " + std::to_string(random_cells) +
                                ", expected at least 1");
  }
}

void require_lattice_rows(const basis::RowMajorMatrixXf& rows) {
  const auto cells = static_cast<std::size_t>(rows.rows());
  if (cells != basis_cell_count() || rows.cols() < 1) {
    throw std::invalid_argument("design: the rows are " + std::to_string(cells) + " x " +
                                std::to_string(rows.cols()) + ", expected " +
                                std::to_string(basis_cell_count()) + " cells and a component");
  }
}

Design published_search(GrowingSet& set, CandidateGate& gate, const ConditionSearchOptions& options,
                        const char* stream, const std::function<std::uint32_t()>& first,
                        const std::function<double(double)>& show, const ProgressCallback& progress,
                        const std::stop_token& stop) {
  std::vector<std::uint32_t> allowed;
  for (std::size_t i = 0; i < gate.size(); ++i) {
    const auto cell = static_cast<std::uint32_t>(i);
    if (gate.allowed(cell)) allowed.push_back(cell);
  }
  const auto wanted = static_cast<std::size_t>(options.sample_count);
  const auto refuse_too_few = [&](std::size_t found) {
    throw std::invalid_argument("design: only " + std::to_string(found) +
                                " usable candidates for " + std::to_string(wanted) + " samples");
  };
  if (allowed.size() < wanted) refuse_too_few(allowed.size());

  Design design;
  design.starts = 1;
  std::vector<std::uint32_t>& chosen = design.cells;
  const auto usable = [&](std::uint32_t cell) {
    return gate.allowed(cell) && std::find(chosen.begin(), chosen.end(), cell) == chosen.end() &&
           gate.accepted(cell);
  };
  const auto join = [&](std::uint32_t cell) {
    set.add(cell);
    chosen.push_back(cell);
  };
  if (first) join(first());
  random::Stream generator(random::make_key(options.seed, stream));

  while (chosen.size() < wanted) {
    const bool hurry = stop.stop_requested();
    design.finished = design.finished && !hurry;
    double best = std::numeric_limits<double>::infinity();
    std::uint32_t cell = 0;
    bool found = false;
    int tried = 0;
    // The published search has no forbidden cells; ours draws until it has as many as asked for
    // that may be used, and gives up where next to none are.
    for (std::size_t draw = 0; tried < (hurry ? 1 : options.random_cells); ++draw) {
      if (draw > 20 * allowed.size() + 1000) break;
      const std::uint32_t next = allowed[generator.below(allowed.size())];
      if (!usable(next)) continue;
      ++tried;
      const double value = set.value_with(next);
      if (!found || value < best) {
        found = true;
        best = value;
        cell = next;
      }
    }
    if (!found) refuse_too_few(chosen.size());
    for (const int step : kSteps) {
      for (bool moved = !hurry; moved;) {
        moved = false;
        for (const std::uint32_t next : neighbours(cell, step)) {
          if (!usable(next)) continue;
          const double value = set.value_with(next);
          if (value < best) {
            best = value;
            cell = next;
            moved = true;
          }
        }
      }
    }
    join(cell);
    if (progress) {
      progress({static_cast<double>(chosen.size()) / static_cast<double>(wanted), show(best)});
    }
  }
  return design;
}

}  // namespace gonio::design
