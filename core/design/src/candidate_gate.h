#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "gonio/design/candidates.h"

namespace gonio::design {

/// Candidates with a memory, so that nobody is asked twice.
class CandidateGate {
 public:
  CandidateGate(const Candidates& candidates, std::size_t cells)
      : accept_(candidates.accept), state_(cells, kUnknown) {
    require_length("a mask", candidates.allowed.size(), cells);
    require_length("noises", candidates.noise.size(), cells);
    require_length("penalties", candidates.penalty.size(), cells);
    for (const std::vector<float>* values : {&candidates.noise, &candidates.penalty}) {
      if (!std::all_of(values->begin(), values->end(),
                       [](float value) { return value >= 0.0F && std::isfinite(value); })) {
        throw std::invalid_argument("design: noise and penalty must be finite and not negative");
      }
    }
    if (candidates.allowed.empty()) return;
    for (std::size_t i = 0; i < cells; ++i) {
      if (candidates.allowed[i] == 0) state_[i] = kRefused;
    }
  }

  std::size_t size() const { return state_.size(); }

  /// Not refused so far.
  bool allowed(std::uint32_t cell) const { return state_[cell] != kRefused; }

  bool accepted(std::uint32_t cell) {
    if (state_[cell] == kUnknown) {
      state_[cell] = !accept_ || accept_(cell) ? kAccepted : kRefused;
    }
    return state_[cell] == kAccepted;
  }

 private:
  static void require_length(const char* what, std::size_t found, std::size_t cells) {
    if (found == 0 || found == cells) return;
    throw std::invalid_argument(std::string("design: ") + what + " of " + std::to_string(found) +
                                " for " + std::to_string(cells) + " cells");
  }

  enum : std::uint8_t { kRefused, kUnknown, kAccepted };
  std::function<bool(std::uint32_t)> accept_;
  std::vector<std::uint8_t> state_;
};

}  // namespace gonio::design
