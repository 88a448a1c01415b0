#include "lattice_moves.h"

#include <algorithm>
#include <array>

#include "gonio/brdf/merl_lattice.h"

namespace gonio::design {

namespace lattice = brdf::lattice;

std::vector<std::uint32_t> neighbours(std::uint32_t cell, int step) {
  const std::vector<std::uint32_t>& cells = lattice::cells_above_horizon();
  const lattice::Index at = lattice::index_from_cell(cells[cell]);
  const auto turned = [](int phi_d) {
    return (phi_d + static_cast<int>(lattice::kPhiD)) % static_cast<int>(lattice::kPhiD);
  };
  const std::array<lattice::Index, 6> moves = {{
      {at.theta_h - step, at.theta_d, at.phi_d},
      {at.theta_h + step, at.theta_d, at.phi_d},
      {at.theta_h, at.theta_d - step, at.phi_d},
      {at.theta_h, at.theta_d + step, at.phi_d},
      {at.theta_h, at.theta_d, turned(at.phi_d - step)},
      {at.theta_h, at.theta_d, turned(at.phi_d + step)},
  }};
  std::vector<std::uint32_t> found;
  for (const lattice::Index& to : moves) {
    if (to.theta_h < 0 || to.theta_h >= static_cast<int>(lattice::kThetaH) || to.theta_d < 0 ||
        to.theta_d >= static_cast<int>(lattice::kThetaD)) {
      continue;
    }
    const auto wanted = static_cast<std::uint32_t>(lattice::cell_from_index(to));
    const auto place = std::lower_bound(cells.begin(), cells.end(), wanted);
    if (place != cells.end() && *place == wanted) {
      found.push_back(static_cast<std::uint32_t>(place - cells.begin()));
    }
  }
  return found;
}

}  // namespace gonio::design
