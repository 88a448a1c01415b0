#pragma once

#include <opencv2/aruco/dictionary.hpp>

namespace gonio::calibration::board {

inline constexpr int kMarkerBits = 4;
inline constexpr int kDictionarySize = 250;

inline cv::Ptr<cv::aruco::Dictionary> dictionary() {
  return cv::aruco::getPredefinedDictionary(cv::aruco::DICT_4X4_250);
}

}  // namespace gonio::calibration::board
