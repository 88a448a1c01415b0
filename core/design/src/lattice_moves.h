#pragma once

#include <cstdint>
#include <vector>

namespace gonio::design {

/// The basis cells `step` lattice indices away along theta_h, theta_d and phi_d, up to six; phi_d
/// wraps by reciprocity, cells below the horizon are left out.
std::vector<std::uint32_t> neighbours(std::uint32_t cell, int step);

}  // namespace gonio::design
