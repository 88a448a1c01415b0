#include <algorithm>
#include <cstddef>
#include <functional>
#include <utility>
#include <vector>

#include "gonio/acquisition/measurement_plan.h"
#include "ways.h"

namespace gonio::acquisition {
namespace {

bool is_exchanged(const rig::PoseSolution& pose) {
  return pose.branch == rig::Branch::C || pose.branch == rig::Branch::D;
}

/// A second half, to be measured behind the point at `place`.
struct SecondHalf {
  double detour_s = kNoWay;
  std::size_t place = 0;
  PlannedPoint point;
};

/// Poses that may be a point's second half; empty when it has none.
using PosesAgain = std::function<std::vector<rig::PoseSolution>(const PlannedPoint& point)>;

/// Chooses second halves for the points of a plan.
class PairSearch {
 public:
  PairSearch(const rig::TravelModel& travel, const std::vector<PlannedPoint>& points)
      : travel_(travel), points_(points), ends_(tour_ends(travel.rig())) {}

  /// `count` pairs whose first halves lie among the first `range` points, one in each of as many
  /// stretches, the second at least `apart` points later.
  void add(std::size_t count, std::size_t range, std::size_t apart, const PosesAgain& poses_again,
           std::vector<SecondHalf>& found) const {
    count = std::min(count, range);
    for (std::size_t k = 0; k < count; ++k) {
      SecondHalf best = this->best(k * range / count, (k + 1) * range / count, apart, poses_again);
      if (best.detour_s < kNoWay) found.push_back(std::move(best));
    }
  }

 private:
  SecondHalf best(std::size_t first, std::size_t last, std::size_t apart,
                  const PosesAgain& poses_again) const {
    SecondHalf best;
    for (std::size_t i = first; i < last; ++i) {
      for (const rig::PoseSolution& pose : poses_again(points_[i])) {
        for (std::size_t place = i + apart; place < points_.size(); ++place) {
          const double detour = detour_s(place, pose);
          if (detour >= best.detour_s) continue;
          PlannedPoint again = points_[i];
          again.pose = pose;
          again.again = true;
          best = {detour, place, std::move(again)};
        }
      }
    }
    return best;
  }

  /// By way of `pose` from the point at `place` to the next, or to the closing white.
  double detour_s(std::size_t place, const rig::PoseSolution& pose) const {
    const rig::Joints& from = points_[place].pose.joints;
    const rig::Joints& to = place + 1 < points_.size() ? points_[place + 1].pose.joints : ends_;
    return seconds_between(travel_, from, pose.joints) + seconds_between(travel_, pose.joints, to) -
           seconds_between(travel_, from, to);
  }

  const rig::TravelModel& travel_;
  const std::vector<PlannedPoint>& points_;
  rig::Joints ends_;
};

}  // namespace

MeasurementPlan with_pairs(const rig::Inverse& inverse, const MeasurementPlan& plan,
                           const PairOptions& options) {
  const rig::TravelModel travel(inverse.rig());
  const PairSearch search(travel, plan.points);
  const std::size_t half = plan.points.size() / 2;
  std::vector<SecondHalf> found;
  search.add(
      static_cast<std::size_t>(options.repeats), half, half,
      [](const PlannedPoint& point) { return std::vector{point.pose}; }, found);
  search.add(
      static_cast<std::size_t>(options.reciprocals), plan.points.size(), 0,
      [&](const PlannedPoint& point) {
        std::vector<rig::PoseSolution> poses = inverse.solve(point.direction).poses;
        std::erase_if(poses, [&](const rig::PoseSolution& pose) {
          return is_exchanged(pose) == is_exchanged(point.pose) ||
                 pose.mirrored != point.pose.mirrored;
        });
        return poses;
      },
      found);
  std::stable_sort(found.begin(), found.end(),
                   [](const SecondHalf& a, const SecondHalf& b) { return a.place < b.place; });

  MeasurementPlan result = plan;
  result.points.clear();
  result.travel_s = 0.0;
  result.lower_bound_s = 0.0;  // of another tour
  result.exact_order = false;
  rig::Joints at = tour_ends(inverse.rig());
  const auto add = [&](PlannedPoint point) {
    const double stay_s = point.predicted_s - point.travel_s;
    point.travel_s = travel.seconds(at, point.pose.joints);
    point.predicted_s = point.travel_s + stay_s;
    result.duration_s += point.predicted_s;
    result.travel_s += point.travel_s;
    at = point.pose.joints;
    result.points.push_back(std::move(point));
  };
  for (const PlannedPoint& point : plan.points) result.duration_s -= point.predicted_s;
  auto next = found.begin();
  for (std::size_t i = 0; i < plan.points.size(); ++i) {
    add(plan.points[i]);
    for (; next != found.end() && next->place == i; ++next) add(std::move(next->point));
  }
  result.travel_s += travel.seconds(at, tour_ends(inverse.rig()));
  return result;
}

}  // namespace gonio::acquisition
