#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace gonio::design {

/// One gain per candidate and the best of every block of them, so that the best of all is found,
/// and found again after it is dismissed, without looking at each.
///
/// Threads  Different blocks may be filled and settled at the same time.
class BlockBest {
 public:
  static constexpr float kNone = -std::numeric_limits<float>::infinity();

  BlockBest(std::size_t size, std::size_t block)
      : block_(block), gains_(size, kNone), best_((size + block - 1) / block) {}

  std::size_t size() const { return gains_.size(); }
  float* data() { return gains_.data(); }
  float operator[](std::size_t candidate) const { return gains_[candidate]; }
  float& operator[](std::size_t candidate) { return gains_[candidate]; }

  /// To be called for the block of a candidate after its gains have changed.
  void settle(std::size_t candidate) {
    const std::size_t from = candidate / block_ * block_;
    const auto first = gains_.begin() + static_cast<std::ptrdiff_t>(from);
    const auto end =
        gains_.begin() + static_cast<std::ptrdiff_t>(std::min(gains_.size(), from + block_));
    best_[candidate / block_] =
        from + static_cast<std::size_t>(std::max_element(first, end) - first);
  }

  void dismiss(std::size_t candidate) {
    gains_[candidate] = kNone;
    settle(candidate);
  }

  /// The candidate with the largest gain, the lowest of equals; `none` when all are kNone.
  std::size_t best(std::size_t none) const {
    std::size_t found = none;
    float gain = kNone;
    for (const std::size_t candidate : best_) {
      if (gains_[candidate] > gain) {
        gain = gains_[candidate];
        found = candidate;
      }
    }
    return found;
  }

 private:
  std::size_t block_;
  std::vector<float> gains_;
  std::vector<std::size_t> best_;
};

}  // namespace gonio::design
