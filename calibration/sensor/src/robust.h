#pragma once

#include <vector>

namespace gonio::calibration::sensor {

/// Median; of an even number the mean of the middle two. Throws std::invalid_argument for none.
double median(std::vector<float> values);

struct MedianAndSpread {
  double median = 0.0;
  double sigma = 0.0;  ///< 1.4826 MAD: the sd of normal values, whatever a few others do
};
MedianAndSpread median_and_spread(const std::vector<float>& values);

}  // namespace gonio::calibration::sensor
