#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace gonio::calibration::routine {

/// A picture's size, row-major, with what of it carries no value.
struct PixelMap {
  int width_px = 0;
  int height_px = 0;
  std::span<const std::uint8_t> bad;  ///< not 0: no value; empty: none is known

  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width_px) +
           static_cast<std::size_t>(column);
  }
  bool is_bad(int row, int column) const { return !bad.empty() && bad[index(row, column)] != 0; }
};

/// Calls visit(row, column) for the good ones of the eight pixels about one.
template <class Visit>
void each_good_neighbour(const PixelMap& map, int row, int column, const Visit& visit) {
  for (int r = std::max(0, row - 1); r <= std::min(map.height_px - 1, row + 1); ++r) {
    for (int c = std::max(0, column - 1); c <= std::min(map.width_px - 1, column + 1); ++c) {
      if ((r != row || c != column) && !map.is_bad(r, c)) visit(r, c);
    }
  }
}

/// Mean of `value(row, column)` over the good neighbours; none where all are bad. A pixel that is
/// left out of a sum instead would draw its centroid, and take its light from it.
template <class Value>
std::optional<double> mean_of_neighbours(const PixelMap& map, int row, int column,
                                         const Value& value) {
  double sum = 0.0;
  int count = 0;
  each_good_neighbour(map, row, column, [&](int r, int c) {
    sum += value(r, c);
    ++count;
  });
  if (count == 0) return std::nullopt;
  return sum / count;
}

}  // namespace gonio::calibration::routine
