#pragma once

#include "gonio/basis/basis.h"

namespace gonio::bench {

inline constexpr int kMaterials = 90;
inline constexpr Eigen::Index kComponents = 80;

/// Smooth random fields over the lattice with the decline of a measured spectrum: a basis of the
/// size of MERL's, without its files. Made at the first call.
const basis::Basis& some_basis();

}  // namespace gonio::bench
