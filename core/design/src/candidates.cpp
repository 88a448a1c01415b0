#include "gonio/design/candidates.h"

#include <algorithm>
#include <stdexcept>
#include <string>

#include "gonio/brdf/merl_lattice.h"

namespace gonio::design {
namespace {

namespace lattice = brdf::lattice;

constexpr double kEdgeRad = 1e-9;  // limits are inclusive to rounding

}  // namespace

std::size_t basis_cell_count() { return lattice::cells_above_horizon().size(); }

brdf::HalfDiff direction_of_basis_cell(std::uint32_t basis_cell) {
  return lattice::angles_of(
      lattice::index_from_cell(lattice::cells_above_horizon().at(basis_cell)));
}

std::optional<std::uint32_t> basis_cell_of(const brdf::HalfDiff& direction) {
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  const auto cell =
      static_cast<std::uint32_t>(lattice::cell_from_index(lattice::nearest_index(direction)));
  const auto found = std::lower_bound(cells.begin(), cells.end(), cell);
  if (found == cells.end() || *found != cell) return std::nullopt;
  return static_cast<std::uint32_t>(found - cells.begin());
}

bool within(const DirectionLimits& limits, const brdf::HalfDiff& direction) {
  const Angle edge = Angle::from_radians(kEdgeRad);
  const brdf::PolarCosines cosines =
      brdf::polar_cosines(direction.theta_h, direction.theta_d, direction.phi_d);
  return cosines.cos_theta_i > 0.0 && cosines.cos_theta_o > 0.0 &&
         cosines.cos_theta_i >= cos(limits.theta_i_max + edge) &&
         cosines.cos_theta_o >= cos(limits.theta_o_max + edge) &&
         direction.theta_d >= limits.theta_d_min - edge;
}

std::vector<std::uint8_t> cells_within(const DirectionLimits& limits) {
  const std::size_t cells = basis_cell_count();
  std::vector<std::uint8_t> mask(cells);
  for (std::size_t i = 0; i < cells; ++i) {
    mask[i] = within(limits, direction_of_basis_cell(static_cast<std::uint32_t>(i)));
  }
  return mask;
}

std::vector<std::uint8_t> basis_mask(std::span<const std::uint8_t> lattice_mask) {
  if (lattice_mask.size() != lattice::kCells) {
    throw std::invalid_argument("candidates: a lattice mask has " +
                                std::to_string(lattice::kCells) + " cells, found " +
                                std::to_string(lattice_mask.size()));
  }
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  std::vector<std::uint8_t> mask(cells.size());
  for (std::size_t i = 0; i < cells.size(); ++i) mask[i] = lattice_mask[cells[i]] != 0;
  return mask;
}

}  // namespace gonio::design
