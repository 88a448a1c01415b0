#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "gonio/brdf/merl_lattice.h"
#include "gonio/rig/kinematics.h"

namespace gonio::rig {

/// Which cells of the lattice (bin centres) a rig can measure.
struct ReachStatistics {
  std::vector<std::uint8_t> reachable;  ///< one byte per lattice cell
  std::size_t valid_cells = 0;          ///< above the horizon
  std::size_t reachable_cells = 0;
  std::map<Reason, std::size_t> refused;  ///< valid cells by first reason
};
/// Parallel; the result does not depend on the number of threads. On rigs without closed form an
/// upper bound (Inverse::maybe_reachable).
ReachStatistics reach_statistics(const Inverse& inverse);

/// Degrees of freedom of an arbitrary rig by random joint sampling within the limits: largest rank
/// of the Jacobian of (cos theta_i, cos theta_o, wi.wo); 2 means in-plane only.
int reach_rank(const RigDescription& rig, std::uint64_t seed = 1);

}  // namespace gonio::rig
