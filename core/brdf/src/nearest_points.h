#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace gonio::brdf {

/// The nearest of a fixed set of points in four dimensions, by a balanced k-d tree.
class NearestPoints {
 public:
  using Point = Eigen::Vector4d;
  struct Found {
    double squared_distance;
    std::size_t index;  ///< into the points given
  };

  explicit NearestPoints(std::vector<Point> points);

  /// The `count` nearest, ascending; of equally far ones those of the lower index. `found` is
  /// overwritten (a buffer of the caller's, for loops).
  void find(const Point& at, std::size_t count, std::vector<Found>& found) const;

  const Point& point(std::size_t index) const { return points_[index]; }

 private:
  void build(std::size_t begin, std::size_t end);
  void search(std::size_t begin, std::size_t end, const Point& at, std::size_t count,
              std::vector<Found>& found) const;

  std::vector<Point> points_;
  std::vector<std::size_t> order_;  ///< the median of a range splits it
  std::vector<int> axis_;           ///< of the split at that place of order_
};

}  // namespace gonio::brdf
