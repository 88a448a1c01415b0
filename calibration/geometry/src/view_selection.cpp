#include "view_selection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "gonio/calibration/result/step_refused.h"

namespace gonio::calibration::geometry {
namespace {

Eigen::Vector3d middle_of(const BoardView& view) {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const BoardCorner& corner : view.corners) sum += corner.point_mm;
  sum /= static_cast<double>(view.corners.size());
  return {sum.x(), sum.y(), 0.0};
}

double median_rms(const std::vector<FittedView>& views) {
  std::vector<double> rms;
  for (const FittedView& view : views) {
    if (view.used) rms.push_back(view.rms_px);
  }
  const auto middle = rms.begin() + static_cast<std::ptrdiff_t>(rms.size() / 2);
  std::nth_element(rms.begin(), middle, rms.end());
  return *middle;
}

}  // namespace

Angle slant_of(const BoardView& view, const Eigen::Isometry3d& camera_from_board) {
  const Eigen::Vector3d sight = camera_from_board * middle_of(view);
  const Eigen::Vector3d normal = camera_from_board.linear().col(2);
  return Angle::from_radians(std::atan2(normal.cross(sight).norm(), std::abs(normal.dot(sight))));
}

std::size_t used_count(const std::vector<FittedView>& views) {
  return static_cast<std::size_t>(
      std::count_if(views.begin(), views.end(), [](const FittedView& v) { return v.used; }));
}

void require_views(const std::string& step, const std::vector<FittedView>& views,
                   std::size_t min_views) {
  if (used_count(views) >= min_views) return;
  std::string left_out;
  for (std::size_t v = 0; v < views.size(); ++v) {
    if (!views[v].used) left_out += fmt::format("; view {} {}", v, views[v].why_not);
  }
  throw StepRefused(fmt::format("{}: {} usable views of {}, expected at least {}: take more{}",
                                step, used_count(views), views.size(), min_views, left_out));
}

bool leave_out_slanted(std::vector<FittedView>& views, Angle max_slant) {
  bool any = false;
  for (FittedView& view : views) {
    if (!view.used || view.slant <= max_slant) continue;
    view.used = false;
    view.why_not = fmt::format("is slanted by {:.1f} deg, at most {:.0f}", view.slant.degrees(),
                               max_slant.degrees());
    any = true;
  }
  return any;
}

bool leave_out_bad(std::vector<FittedView>& views, double factor) {
  const double limit = factor * median_rms(views);
  bool any = false;
  for (FittedView& view : views) {
    if (!view.used || view.rms_px <= limit) continue;
    view.used = false;
    view.bad_fit = true;
    view.why_not = fmt::format("fits with {:.2f} px rms, at most {:.2f}", view.rms_px, limit);
    any = true;
  }
  return any;
}

void require_agreement(const std::string& step, const std::vector<FittedView>& views,
                       double max_bad_fraction, const std::string& advice) {
  const auto bad =
      std::count_if(views.begin(), views.end(), [](const FittedView& v) { return v.bad_fit; });
  if (static_cast<double>(bad) <= max_bad_fraction * static_cast<double>(views.size())) return;
  throw StepRefused(
      fmt::format("{}: {} of {} views contradict the rest, expected {:.0f} % at most: "
                  "{}",
                  step, bad, views.size(), 100.0 * max_bad_fraction, advice));
}

}  // namespace gonio::calibration::geometry
