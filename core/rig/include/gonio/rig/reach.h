#pragma once

#include <cstdint>
#include <map>
#include <optional>
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

/// The reachable lattice cell (bin centre) closest to a direction that was refused, to be offered
/// in its place. Closest means the smallest root of the summed squared chords of wi and wo, after
/// the best turn about the normal and, if the rig may, exchange of light and detector; how much
/// the reconstruction would notice is not weighed.
///
/// Cost     One pass over the lattice (about 0.1 s); on rigs without closed form the best few
///          candidates are confirmed by solve().
/// Returns  Nothing when no cell is reachable.
struct Substitute {
  brdf::HalfDiff direction;
  Angle distance;  ///< the larger of the turns of wi and of wo, roughly: chord as an angle
};
std::optional<Substitute> nearest_reachable(const Inverse& inverse,
                                            const brdf::HalfDiff& direction);

/// Degrees of freedom of an arbitrary rig by random joint sampling within the limits: largest rank
/// of the Jacobian of (cos theta_i, cos theta_o, wi.wo); 2 means in-plane only.
int reach_rank(const RigDescription& rig, std::uint64_t seed = 1);

}  // namespace gonio::rig
