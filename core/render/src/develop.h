#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace gonio::render {

/// Linear light as it will be shown: exposed, highlights rolled off softly instead of clipped.
inline double shown_linear(double radiance, double exposure) {
  constexpr double kKnee = 0.75;
  constexpr double kRoom = 1.0 - kKnee;
  const double value = std::max(0.0, radiance * exposure);
  return value <= kKnee ? value : kKnee + kRoom * (1.0 - std::exp((kKnee - value) / kRoom));
}

inline Eigen::Array3d shown_linear(const Eigen::Array3f& radiance, double exposure) {
  return {shown_linear(double{radiance[0]}, exposure), shown_linear(double{radiance[1]}, exposure),
          shown_linear(double{radiance[2]}, exposure)};
}

}  // namespace gonio::render
