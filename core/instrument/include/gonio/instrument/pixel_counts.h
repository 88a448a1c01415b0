#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

namespace gonio::instrument {

/// How often each value occurs among the pixels of a frame: ranks of millions of them in one pass,
/// without a copy that is put in order.
///
/// Threads  const, may be shared.
class PixelCounts {
 public:
  explicit PixelCounts(std::span<const std::uint16_t> pixels_dn) : counts_(kValues, 0) {
    for (const std::uint16_t pixel : pixels_dn) ++counts_[pixel];
    all_ = pixels_dn.size();
  }

  /// What stands at place `n`, from 0, when the pixels are put in rising order, DN.
  /// Throws std::out_of_range when there are not so many.
  std::uint16_t nth_smallest(std::size_t n) const {
    if (n >= all_) throw std::out_of_range("pixel counts: there are not so many pixels");
    std::size_t value = 0;
    for (std::size_t passed = counts_[0]; passed <= n; passed += counts_[value]) ++value;
    return static_cast<std::uint16_t>(value);
  }

  /// The same in falling order.
  std::uint16_t nth_largest(std::size_t n) const {
    if (n >= all_) throw std::out_of_range("pixel counts: there are not so many pixels");
    return nth_smallest(all_ - 1 - n);
  }

  /// How many pixels are brighter than a level, DN.
  std::size_t above(double level_dn) const {
    std::size_t found = 0;
    for (std::size_t value = kValues; value-- > 0 && static_cast<double>(value) > level_dn;) {
      found += counts_[value];
    }
    return found;
  }

 private:
  static constexpr std::size_t kValues = 65536;

  std::vector<std::size_t> counts_;
  std::size_t all_ = 0;
};

}  // namespace gonio::instrument
