#include "gonio/brdf/shading_geometry.h"

#include <cmath>

namespace gonio::brdf {

ShadingGeometry shading_geometry(const DirectionPair& pair) {
  const HalfDiff angles = half_diff_from_directions(pair);
  const Eigen::Vector3d sum = pair.wi + pair.wo;
  const double length = sum.norm();
  return {angles,
          pair.wi.z(),
          pair.wo.z(),
          sum.z() / length,
          std::hypot(sum.x(), sum.y()) / length,
          0.5 * length,
          0.5 * (pair.wi - pair.wo).norm(),
          std::cos(angles.phi_d.radians()),
          std::sin(angles.phi_d.radians())};
}

ShadingGeometry shading_geometry(const HalfDiff& half_diff) {
  ShadingGeometry geometry = shading_geometry(SinCos(half_diff.theta_h), SinCos(half_diff.theta_d),
                                              SinCos(half_diff.phi_d));
  geometry.half_diff.phi_h = half_diff.phi_h;
  return geometry;
}

}  // namespace gonio::brdf
