#include "gonio/brdf/rgb_curve.h"

namespace gonio::brdf {

RgbCurve::RgbCurve(const std::function<Eigen::Array3d(double)>& function) {
  segments_.reserve(kSegments);
  constexpr double kStep = 1.0 / kSegments;
  for (int index = 0; index < kSegments; ++index) {
    const auto at = [&](int third) {
      return function(std::fmin((index + third / 3.0) * kStep, 1.0));
    };
    const Eigen::Array3d f0 = at(0);
    const Eigen::Array3d f1 = at(1);
    const Eigen::Array3d f2 = at(2);
    const Eigen::Array3d f3 = at(3);
    // Newton's divided differences at t = 0, 1/3, 2/3, 1, multiplied out.
    const Eigen::Array3d d1 = 3.0 * (f1 - f0);
    const Eigen::Array3d d2 = 4.5 * (f2 - 2.0 * f1 + f0);
    const Eigen::Array3d d3 = 4.5 * (f3 - 3.0 * f2 + 3.0 * f1 - f0);
    segments_.push_back({f0, d1 - d2 / 3.0 + 2.0 / 9.0 * d3, d2 - d3, d3});
  }
}

}  // namespace gonio::brdf
