#include "gonio/render/studio.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace gonio::render {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr double kOwnSoftness = 0.35 * kDegree;  // an edge of cloth, not of a knife

/// A bright rectangle, in angles across and up from its middle.
struct Panel {
  Eigen::Vector3d middle;
  Eigen::Vector3d across;
  Eigen::Vector3d up;
  double half_width;
  double half_height;
  Eigen::Array3d radiance;
};

Panel panel(const Eigen::Vector3d& towards, double half_width_deg, double half_height_deg,
            const Eigen::Array3d& radiance) {
  const Eigen::Vector3d middle = towards.normalized();
  const Eigen::Vector3d vertical =
      std::abs(middle.y()) > 0.95 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d across = vertical.cross(middle).normalized();
  return {
      middle,  across, middle.cross(across), half_width_deg * kDegree, half_height_deg * kDegree,
      radiance};
}

/// The panel shifted by angles within its own plane: how panes share a window.
Panel pane(const Panel& window, double right_deg, double up_deg, double half_width_deg,
           double half_height_deg) {
  const Eigen::Vector3d towards = window.middle + std::tan(right_deg * kDegree) * window.across +
                                  std::tan(up_deg * kDegree) * window.up;
  return panel(towards, half_width_deg, half_height_deg, window.radiance);
}

std::vector<Panel> make_panels() {
  const Eigen::Array3d daylight(5.2, 5.9, 7.0);
  const Eigen::Array3d tungsten(6.2, 5.4, 4.4);
  std::vector<Panel> panels;
  panels.push_back(panel({-0.62, 0.62, 0.60}, 19.0, 23.0, {5.8, 5.7, 5.5}));
  const Panel window = panel({0.80, 0.30, 0.52}, 1.0, 1.0, daylight);
  for (const double right : {-6.0, 6.0}) {
    for (const double up : {-8.5, 8.5}) panels.push_back(pane(window, right, up, 5.2, 7.7));
  }
  panels.push_back(panel({0.88, 0.05, -0.50}, 5.0, 38.0, daylight));
  panels.push_back(panel({-0.86, -0.05, -0.52}, 5.0, 34.0, tungsten));
  return panels;
}

/// Share of a smoothing kernel of the given half width that lies below `x`: 0 to 1.
double below(double x, double half_width) {
  const double t = std::clamp(x / half_width, -1.0, 1.0);
  return 0.5 + t * (0.75 - 0.25 * t * t);
}

double covered(double x, double half_extent, double softness) {
  return below(x + half_extent, softness) - below(x - half_extent, softness);
}

}  // namespace

Eigen::Array3d studio_radiance(const Eigen::Vector3d& direction, double width_rad) {
  static const std::vector<Panel> panels = make_panels();
  static const Eigen::Array3d ceiling(0.95, 0.98, 1.05);
  static const Eigen::Array3d wall(0.31, 0.31, 0.32);
  static const Eigen::Array3d floor(0.085, 0.08, 0.075);
  const double softness = std::max(kOwnSoftness, 0.9 * width_rad);

  const double elevation = std::asin(std::clamp(direction.y(), -1.0, 1.0));
  const double high = below(elevation - 38.0 * kDegree, std::max(45.0 * kDegree, softness));
  const double low = below(-elevation - 14.0 * kDegree, std::max(5.0 * kDegree, softness));
  Eigen::Array3d radiance = wall + (ceiling - wall) * high;
  radiance += (floor - radiance) * low;

  for (const Panel& light : panels) {
    const double ahead = direction.dot(light.middle);
    if (ahead <= 0.0) continue;
    const double x = std::atan2(direction.dot(light.across), ahead);
    const double y = std::atan2(direction.dot(light.up), ahead);
    const double share =
        covered(x, light.half_width, softness) * covered(y, light.half_height, softness);
    if (share > 0.0) radiance += light.radiance * share;
  }
  return radiance;
}

}  // namespace gonio::render
