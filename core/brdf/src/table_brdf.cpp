#include <algorithm>
#include <cmath>

#include "fast_atan2.h"
#include "gonio/brdf/brdf_table.h"
#include "large_pages.h"
#include "lattice_position.h"

namespace gonio::brdf {
namespace {

double square(double x) { return x * x; }

Rgb weighted_mean(const Eigen::Array4d& sum) {
  if (!(sum[3] > 0.0)) return Rgb::Zero();
  return sum.head<3>() / sum[3];
}

}  // namespace

TableBrdf::TableBrdf(const BrdfTable& table, Interpolation how)
    : convention_(table.convention()),
      how_(how),
      cells_(on_large_pages<decltype(cells_)>(lattice::kCells, Eigen::Array4d::Zero())) {
  for (const std::uint32_t cell : lattice::cells_above_horizon(convention_)) {
    if (!table.valid(cell)) continue;
    cells_[cell].head<3>() = table.value(cell);
    cells_[cell][3] = 1.0;
  }
}

Rgb TableBrdf::evaluate(const DirectionPair& pair) const {
  if (!(pair.wi.z() > 0.0 && pair.wo.z() > 0.0)) return Rgb::Zero();
  // half_diff_from_directions() without what the lattice does not need: norms cancel, phi_h drops
  // out, and no sine or cosine is taken.
  const Eigen::Vector3d sum = pair.wi + pair.wo;
  const Eigen::Vector3d difference = pair.wi - pair.wo;
  const double tangential2 = square(sum.x()) + square(sum.y());
  const double tangential = std::sqrt(tangential2);
  const double norm = std::sqrt(tangential2 + square(sum.z()));
  // Azimuth of the half vector; x by convention at the pole.
  const double cos_phi_h = tangential > 0.0 ? sum.x() / tangential : 1.0;
  const double sin_phi_h = tangential > 0.0 ? sum.y() / tangential : 0.0;
  const double along = cos_phi_h * difference.x() + sin_phi_h * difference.y();
  const double across = (cos_phi_h * difference.y() - sin_phi_h * difference.x()) * norm;
  const double outward = sum.z() * along - tangential * difference.z();
  // Reciprocity lets both change sign together, which folds phi_d into [0, 180] deg.
  const double sign = across < 0.0 ? -1.0 : 1.0;
  return at(atan2_upper(tangential, sum.z()), atan2_upper(difference.norm(), norm),
            atan2_upper(sign * across, sign * outward));
}

Rgb TableBrdf::evaluate(const HalfDiff& angles) const {
  if (!above_horizon(angles.theta_h, angles.theta_d, angles.phi_d)) return Rgb::Zero();
  return at(angles.theta_h.radians(), angles.theta_d.radians(), angles.phi_d.radians());
}

Rgb TableBrdf::evaluate_visible(const ShadingGeometry& geometry) const {
  const HalfDiff& angles = geometry.half_diff;
  return at(angles.theta_h.radians(), angles.theta_d.radians(), angles.phi_d.radians());
}

Rgb TableBrdf::at(double theta_h_rad, double theta_d_rad, double phi_d_rad) const {
  if (how_ == Interpolation::nearest) {
    const HalfDiff angles{Angle::from_radians(theta_h_rad), Angle::from_radians(theta_d_rad),
                          Angle::from_radians(phi_d_rad), Angle()};
    return cells_[lattice::cell_from_index(lattice::nearest_index(angles, convention_))].head<3>();
  }
  const lattice::Position p =
      lattice::position_of(theta_h_rad, theta_d_rad, phi_d_rad, convention_);
  // Unusable cells hold zeros, weight included, so they drop out without a branch.
  const auto along_phi = [&](int theta_h, int theta_d) -> Eigen::Array4d {
    const Eigen::Array4d* row = &cells_[lattice::cell_from_index({theta_h, theta_d, 0})];
    return row[p.phi_d.lower] * (1.0 - p.phi_d.upper_weight) +
           row[p.phi_d.upper] * p.phi_d.upper_weight;
  };
  const auto along_theta_d = [&](int theta_h) -> Eigen::Array4d {
    return along_phi(theta_h, p.theta_d.lower) * (1.0 - p.theta_d.upper_weight) +
           along_phi(theta_h, p.theta_d.upper) * p.theta_d.upper_weight;
  };
  return weighted_mean(along_theta_d(p.theta_h.lower) * (1.0 - p.theta_h.upper_weight) +
                       along_theta_d(p.theta_h.upper) * p.theta_h.upper_weight);
}

}  // namespace gonio::brdf
