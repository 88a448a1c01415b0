#include "board_checks.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <set>

#include "gonio/calibration/result/step_refused.h"

namespace gonio::calibration::geometry {

void check_views(const std::string& step, std::span<const BoardView> views, std::size_t min_corners,
                 int width_px, int height_px) {
  std::map<int, Eigen::Vector2d> places;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto& corners = views[v].corners;
    if (corners.size() < min_corners) {
      throw StepRefused(
          fmt::format("{}: view {} shows {} corners, expected at least {}: show more "
                      "of the board or leave the view out",
                      step, v, corners.size(), min_corners));
    }
    std::set<int> ids;
    for (const BoardCorner& corner : corners) {
      const std::string which = fmt::format("{}: corner {} of view {}", step, corner.id, v);
      if (!corner.pixel.allFinite() || !corner.point_mm.allFinite()) {
        throw StepRefused(which + " is not a number: detect the corners again");
      }
      if (!ids.insert(corner.id).second) {
        throw StepRefused(which + " is given twice, expected once: detect the corners again");
      }
      // Half a pixel of the border belongs to the outer pixels.
      const bool inside = corner.pixel.x() >= -0.5 && corner.pixel.y() >= -0.5 &&
                          corner.pixel.x() <= width_px - 0.5 && corner.pixel.y() <= height_px - 0.5;
      if (!inside) {
        throw StepRefused(
            fmt::format("{} lies at pixel ({:.1f}, {:.1f}), outside the image of {} "
                        "x {}: the views are of another camera or window",
                        which, corner.pixel.x(), corner.pixel.y(), width_px, height_px));
      }
      const auto [known, fresh] = places.try_emplace(corner.id, corner.point_mm);
      constexpr double kSamePlace_mm = 1e-6;  // far below any print
      if (!fresh && (known->second - corner.point_mm).norm() > kSamePlace_mm) {
        throw StepRefused(which +
                          " has another place on the board than in an earlier view: one "
                          "board for all views");
      }
    }
  }
}

double rms_of_pixels(const Eigen::VectorXd& residual) {
  return std::sqrt(2.0 * residual.squaredNorm() / static_cast<double>(residual.size()));
}

}  // namespace gonio::calibration::geometry
