#pragma once

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
    if (candidates.allowed.empty()) return;
    if (candidates.allowed.size() != cells) {
      throw std::invalid_argument("design: a mask of " + std::to_string(candidates.allowed.size()) +
                                  " for " + std::to_string(cells) + " cells");
    }
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
  enum : std::uint8_t { kRefused, kUnknown, kAccepted };
  std::function<bool(std::uint32_t)> accept_;
  std::vector<std::uint8_t> state_;
};

}  // namespace gonio::design
