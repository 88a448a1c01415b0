#include <stdexcept>

#include "gonio/basis/basis.h"

namespace gonio::basis {
namespace {

namespace lattice = brdf::lattice;

const std::vector<std::int32_t>& column_of_cell() {
  static const std::vector<std::int32_t> columns = [] {
    std::vector<std::int32_t> column(lattice::kCells, -1);
    const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
    for (std::size_t i = 0; i < cells.size(); ++i) column[cells[i]] = static_cast<std::int32_t>(i);
    return column;
  }();
  return columns;
}

/// The first cell above the horizon on the way to smaller theta_d, which always leads there.
std::uint32_t nearest_cell_above_horizon(const brdf::HalfDiff& direction) {
  lattice::Index index = lattice::nearest_index(direction);
  const std::vector<std::uint8_t>& above = lattice::above_horizon_mask();
  while (index.theta_d > 0 && above[lattice::cell_from_index(index)] == 0) --index.theta_d;
  return static_cast<std::uint32_t>(lattice::cell_from_index(index));
}

}  // namespace

BasisRows::BasisRows(const Basis& basis) : basis_(basis), column_of_cell_(column_of_cell()) {
  if (static_cast<std::size_t>(basis.mean.size()) != lattice::cells_above_horizon().size() ||
      basis.components.rows() != basis.mean.size()) {
    throw std::invalid_argument("BasisRows: the basis does not cover the cells above the horizon");
  }
}

BasisRow BasisRows::at(const brdf::HalfDiff& direction) const {
  if (!brdf::above_horizon(direction.theta_h, direction.theta_d, direction.phi_d)) {
    throw std::invalid_argument("BasisRows: the direction is below the horizon");
  }
  lattice::Corners corners = lattice::trilinear_corners(
      direction, brdf::IndexConvention::bin_centre, lattice::above_horizon_mask());
  if (corners.count == 0) {
    corners.cells[0] = nearest_cell_above_horizon(direction);
    corners.weights[0] = 1.0;
    corners.count = 1;
  }

  BasisRow row;
  row.q = Eigen::VectorXd::Zero(basis_.components.cols());
  for (std::size_t i = 0; i < static_cast<std::size_t>(corners.count); ++i) {
    const Eigen::Index column = column_of_cell_[corners.cells[i]];
    row.q += corners.weights[i] * basis_.components.row(column).transpose().cast<double>();
    row.mean += corners.weights[i] * static_cast<double>(basis_.mean[column]);
  }
  row.weight = basis_.mapping.weight(
      brdf::polar_cosines(direction.theta_h, direction.theta_d, direction.phi_d));
  return row;
}

}  // namespace gonio::basis
