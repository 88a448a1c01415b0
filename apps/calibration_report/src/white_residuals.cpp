#include "white_residuals.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sections.h"

namespace gonio::calibration_report {
namespace {

using page::Point;

/// Twice the area of o, a, b; above 0 when they turn to the left.
double cross(Point o, Point a, Point b) {
  return (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x);
}

/// One side of the hull of points in order.
template <typename Iterator>
std::vector<Point> chain(Iterator begin, Iterator end) {
  std::vector<Point> side;
  for (Iterator p = begin; p != end; ++p) {
    while (side.size() > 1 && cross(side[side.size() - 2], side.back(), *p) <= 0.0) side.pop_back();
    side.push_back(*p);
  }
  return side;
}

double degrees_of_tangent(double tangent) { return std::atan(tangent) * 180.0 / std::numbers::pi; }

}  // namespace

std::vector<WhiteResidual> white_residuals(const CalibrationReportData& data) {
  const auto* seen = seen_by(data, "flat_field");
  if (seen == nullptr || !data.findings.fields) return {};
  std::vector<WhiteResidual> all;
  for (const calibration::WhiteView& view : seen->whites) {
    if (view.joints.size() != data.instrument.rig.axes.size()) return {};
    if (view.channel < 0 || view.channel > 2) return {};
    const double constant = data.findings.fields->constant[static_cast<std::size_t>(view.channel)];
    for (const calibration::PixelSignal& pixel : view.pixels) {
      const auto factor = calibration::white_factor(data.instrument, view, pixel);
      if (!factor || !(constant * factor->per_constant > 0.0)) continue;
      all.push_back({pixel.column,
                     pixel.row,
                     100.0 * (pixel.dn_per_s / (constant * factor->per_constant) - 1.0),
                     {degrees_of_tangent(factor->lamp_x), degrees_of_tangent(factor->lamp_y)}});
    }
  }
  return all;
}

std::vector<Point> convex_hull(std::vector<Point> points) {
  std::erase_if(points, [](Point p) { return !std::isfinite(p.x) || !std::isfinite(p.y); });
  std::sort(points.begin(), points.end(),
            [](Point a, Point b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  std::vector<Point> hull = chain(points.begin(), points.end());
  std::vector<Point> upper = chain(points.rbegin(), points.rend());
  if (hull.size() + upper.size() < 5) return {};
  hull.insert(hull.end(), upper.begin() + 1, upper.end());
  return hull;
}

bool inside(const std::vector<Point>& hull, Point p) {
  for (std::size_t i = 1; i < hull.size(); ++i) {
    if (cross(hull[i - 1], hull[i], p) < 0.0) return false;
  }
  return hull.size() > 3;
}

}  // namespace gonio::calibration_report
