#include "gonio/brdf/merl_lattice.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>

#include "lattice_position.h"
#include "sin_cos.h"

namespace gonio::brdf {

std::string_view to_string(IndexConvention convention) {
  switch (convention) {
    case IndexConvention::left_edge:
      return "left_edge";
    case IndexConvention::dtu:
      return "dtu";
    case IndexConvention::bin_centre:
      break;
  }
  return "bin_centre";
}

IndexConvention index_convention_from_string(std::string_view name) {
  for (const auto convention :
       {IndexConvention::left_edge, IndexConvention::bin_centre, IndexConvention::dtu}) {
    if (name == to_string(convention)) return convention;
  }
  throw std::invalid_argument("unknown lattice convention \"" + std::string(name) +
                              "\", expected left_edge, bin_centre or dtu");
}

namespace lattice {
namespace {

/// What an index of each axis stands for.
double theta_h_deg(int index, IndexConvention convention) {
  const double offset =
      convention == IndexConvention::dtu ? kDtuThetaHOffset : index_offset(convention);
  const double u = (index + offset) / 90.0;
  return 90.0 * u * u;
}
double theta_d_deg(int index, IndexConvention convention) {
  if (convention == IndexConvention::dtu) return index * kDtuThetaDStep;
  return index + index_offset(convention);
}
double phi_d_deg(int index, IndexConvention convention) {
  if (convention == IndexConvention::dtu) return index * kDtuPhiDStep;
  return index + index_offset(convention);
}

/// NaN lands on index 0.
int clamped(double index, std::size_t count) {
  if (!(index > 0.0)) return 0;
  return static_cast<int>(std::min(index, static_cast<double>(count) - 1.0));
}

/// Angles that stand on a bin edge belong to the upper bin, whatever rounding did to them.
int bin(double coordinate, std::size_t count) {
  constexpr double kEdgeRounding = 1e-9;
  return clamped(coordinate + kEdgeRounding, count);
}

int nearest(double coordinate, std::size_t count) { return clamped(coordinate + 0.5, count); }

/// The cells above the horizon, as a list and as a mask.
struct Horizon {
  std::vector<std::uint32_t> cells;
  std::vector<std::uint8_t> mask;

  explicit Horizon(IndexConvention convention) : mask(kCells, 0) {
    const LatticeSinCos axes(convention);
    cells.reserve(kCells);
    std::uint32_t cell = 0;
    for (const SinCos& h : axes.theta_h) {
      for (const SinCos& d : axes.theta_d) {
        for (const SinCos& p : axes.phi_d) {
          if (above_horizon(h, d, p.cosine)) {
            mask[cell] = 1;
            cells.push_back(cell);
          }
          ++cell;
        }
      }
    }
    cells.shrink_to_fit();
  }
};

/// Function-local statics: initialised once, thread-safe, and only the convention asked for.
const Horizon& horizon(IndexConvention convention) {
  switch (convention) {
    case IndexConvention::left_edge: {
      static const Horizon left_edge(IndexConvention::left_edge);
      return left_edge;
    }
    case IndexConvention::dtu: {
      static const Horizon dtu(IndexConvention::dtu);
      return dtu;
    }
    case IndexConvention::bin_centre:
      break;
  }
  static const Horizon bin_centre(IndexConvention::bin_centre);
  return bin_centre;
}

}  // namespace

HalfDiff angles_of(Index index, IndexConvention convention) {
  return {Angle::from_degrees(theta_h_deg(index.theta_h, convention)),
          Angle::from_degrees(theta_d_deg(index.theta_d, convention)),
          Angle::from_degrees(phi_d_deg(index.phi_d, convention)), Angle()};
}

Index nearest_index(const HalfDiff& angles, IndexConvention convention) {
  const double theta_h_rad = std::clamp(angles.theta_h.radians(), 0.0, std::numbers::pi / 2.0);
  const double u = theta_h_coordinate(theta_h_rad);
  const double theta_d = angles.theta_d.degrees();
  const bool half_turn = angles.phi_d.radians() == std::numbers::pi;
  const double phi_d = half_turn ? 180.0 : fold_phi_d(angles.phi_d.degrees());
  if (convention == IndexConvention::dtu) {
    return {nearest(u - kDtuThetaHOffset, kThetaH), nearest(theta_d / kDtuThetaDStep, kThetaD),
            nearest(phi_d / kDtuPhiDStep, kPhiD)};
  }
  return {bin(u, kThetaH), bin(theta_d, kThetaD), bin(phi_d, kPhiD)};
}

const std::vector<std::uint32_t>& cells_above_horizon(IndexConvention convention) {
  return horizon(convention).cells;
}

const std::vector<std::uint8_t>& above_horizon_mask(IndexConvention convention) {
  return horizon(convention).mask;
}

Corners trilinear_corners(const HalfDiff& angles, IndexConvention convention,
                          const std::vector<std::uint8_t>& usable) {
  if (usable.size() != kCells) {
    throw std::invalid_argument("trilinear_corners: mask has " + std::to_string(usable.size()) +
                                " cells, expected " + std::to_string(kCells));
  }
  const Position at = position_of(angles.theta_h.radians(), angles.theta_d.radians(),
                                  angles.phi_d.radians(), convention);
  Corners corners{};
  double sum = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const bool up_h = (corner & 4) != 0;
    const bool up_d = (corner & 2) != 0;
    const bool up_p = (corner & 1) != 0;
    const double weight = (up_h ? at.theta_h.upper_weight : 1.0 - at.theta_h.upper_weight) *
                          (up_d ? at.theta_d.upper_weight : 1.0 - at.theta_d.upper_weight) *
                          (up_p ? at.phi_d.upper_weight : 1.0 - at.phi_d.upper_weight);
    const std::size_t cell = cell_from_index({up_h ? at.theta_h.upper : at.theta_h.lower,
                                              up_d ? at.theta_d.upper : at.theta_d.lower,
                                              up_p ? at.phi_d.upper : at.phi_d.lower});
    if (weight <= 0.0 || usable[cell] == 0) continue;
    const auto slot = static_cast<std::size_t>(corners.count++);
    corners.cells[slot] = static_cast<std::uint32_t>(cell);
    corners.weights[slot] = weight;
    sum += weight;
  }
  for (std::size_t i = 0; i < static_cast<std::size_t>(corners.count); ++i) {
    corners.weights[i] /= sum;
  }
  return corners;
}

}  // namespace lattice
}  // namespace gonio::brdf
