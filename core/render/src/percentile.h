#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace gonio::render {

/// The value below which `fraction` of the values lie, linear between ranks; 0 for none.
inline double percentile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0.0;
  const double rank = fraction * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::ptrdiff_t>(rank);
  std::nth_element(values.begin(), values.begin() + below, values.end());
  const double low = values[static_cast<std::size_t>(below)];
  if (static_cast<std::size_t>(below) + 1 == values.size()) return low;
  const double high = *std::min_element(values.begin() + below + 1, values.end());
  return low + (rank - static_cast<double>(below)) * (high - low);
}

}  // namespace gonio::render
