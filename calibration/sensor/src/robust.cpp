#include "robust.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace gonio::calibration::sensor {

double median(std::vector<float> values) {
  if (values.empty()) throw std::invalid_argument("median of no values");
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  const double upper = *middle;
  if (values.size() % 2 == 1) return upper;
  return 0.5 * (upper + *std::max_element(values.begin(), middle));
}

MedianAndSpread median_and_spread(const std::vector<float>& values) {
  MedianAndSpread result;
  result.median = median(values);
  std::vector<float> distance(values.size());
  std::transform(values.begin(), values.end(), distance.begin(),
                 [&](float value) { return static_cast<float>(std::abs(value - result.median)); });
  constexpr double kNormal = 1.4826;  // 1 / quantile(3/4) of the normal distribution
  result.sigma = kNormal * median(std::move(distance));
  return result;
}

}  // namespace gonio::calibration::sensor
