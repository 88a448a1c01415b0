#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace gonio::brdf {

/// Where a number stands on a regular axis of `count` nodes over [0, 1]: between `node` and the
/// next, `fraction` of the way.
struct AxisPlace {
  std::size_t node;
  double fraction;

  /// Clamped to the axis; `count` >= 2.
  static AxisPlace on(double position, std::size_t count);
};

/// One value of a row-major grid over [0, 1]^2 (height rows along y, width along x), bilinear.
double bilinear(std::span<const float> grid, std::size_t width, AxisPlace x, AxisPlace y);

/// Densities over the unit square, one per value of a parameter (here theta_i), and the map from
/// the square to itself that makes each uniform: first along y by the marginal, then along x by the
/// conditional distribution. Between two parameter values the densities are mixed linearly, each
/// normalised to integral 1.
///
/// Shape    `slices` x height x width floats, row-major, width along x.
/// Source   Dupuy and Jakob, "An Adaptive Parameterization for Efficient Material Acquisition and
///          Rendering", ACM TOG 37(6), 2018, section 4; the piecewise bilinear density integrated
///          exactly.
/// Threads  const members from many.
class BilinearWarp {
 public:
  /// Throws std::invalid_argument, naming the slice, for an extent below 2, a size that does not
  /// fit, a negative value or a slice that is zero everywhere.
  BilinearWarp(std::vector<float> densities, std::size_t slices, std::size_t height,
               std::size_t width);

  struct Point {
    double x;
    double y;
  };

  /// The point of the uniform square that (x, y) comes from: the cumulative distributions at it.
  Point to_uniform(Point at, std::size_t slice, double fraction) const;

  /// The inverse at one slice: where a point of the uniform square goes.
  Point from_uniform(Point uniform, std::size_t slice) const;

 private:
  std::size_t slices_;
  std::size_t height_;
  std::size_t width_;
  std::vector<float> density_;   ///< normalised
  std::vector<float> along_x_;   ///< integral of a row from 0 to each node
  std::vector<double> along_y_;  ///< slices x height: integral of the row totals
};

}  // namespace gonio::brdf
