#include "nearest_points.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace gonio::brdf {
namespace {

constexpr std::size_t kLeaf = 8;

bool nearer(const NearestPoints::Found& a, const NearestPoints::Found& b) {
  return a.squared_distance != b.squared_distance ? a.squared_distance < b.squared_distance
                                                  : a.index < b.index;
}

}  // namespace

NearestPoints::NearestPoints(std::vector<Point> points)
    : points_(std::move(points)), order_(points_.size()), axis_(points_.size(), 0) {
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  build(0, order_.size());
}

void NearestPoints::build(std::size_t begin, std::size_t end) {
  if (end - begin <= kLeaf) return;
  Point low = points_[order_[begin]];
  Point high = low;
  for (std::size_t i = begin; i < end; ++i) {
    low = low.cwiseMin(points_[order_[i]]);
    high = high.cwiseMax(points_[order_[i]]);
  }
  int axis = 0;
  (high - low).maxCoeff(&axis);
  const std::size_t middle = begin + (end - begin) / 2;
  const auto at = [&](std::size_t i) { return order_.begin() + static_cast<std::ptrdiff_t>(i); };
  std::nth_element(at(begin), at(middle), at(end), [&](std::size_t a, std::size_t b) {
    return std::pair(points_[a][axis], a) < std::pair(points_[b][axis], b);
  });
  axis_[middle] = axis;
  build(begin, middle);
  build(middle + 1, end);
}

void NearestPoints::find(const Point& at, std::size_t count, std::vector<Found>& found) const {
  found.clear();
  search(0, order_.size(), at, std::min(count, order_.size()), found);
  std::sort(found.begin(), found.end(), nearer);
}

void NearestPoints::search(std::size_t begin, std::size_t end, const Point& at, std::size_t count,
                           std::vector<Found>& found) const {
  const auto offer = [&](std::size_t index) {
    const Found candidate{(points_[index] - at).squaredNorm(), index};
    if (found.size() == count) {
      if (!nearer(candidate, found.front())) return;
      std::pop_heap(found.begin(), found.end(), nearer);
      found.pop_back();
    }
    found.push_back(candidate);
    std::push_heap(found.begin(), found.end(), nearer);
  };
  if (end - begin <= kLeaf) {
    for (std::size_t i = begin; i < end; ++i) offer(order_[i]);
    return;
  }
  const std::size_t middle = begin + (end - begin) / 2;
  const std::size_t split = order_[middle];
  const double beyond = at[axis_[middle]] - points_[split][axis_[middle]];
  const bool low_first = beyond < 0.0;
  low_first ? search(begin, middle, at, count, found) : search(middle + 1, end, at, count, found);
  offer(split);
  if (found.size() < count || beyond * beyond <= found.front().squared_distance) {
    low_first ? search(middle + 1, end, at, count, found) : search(begin, middle, at, count, found);
  }
}

}  // namespace gonio::brdf
