#pragma once

#include "gonio/rig/kinematics.h"

namespace gonio::rig {

/// Result of one descent.
struct NumericSolution {
  Joints joints;
  double residual = 0.0;  ///< norm of the six differences of wi and wo; unit vectors
};

/// Below this the pose realises the direction; a descent on a rig that can gets to rounding.
inline constexpr double kSolvedResidual = 1e-9;

enum class StayWithinLimits { No, Yes };

/// Joints for which the rig shows `target` at the sample origin, up to a turn psi about the
/// normal, near `seed`.
///
/// Method   Levenberg-Marquardt over (joints, psi) on [Rz(psi) wi(q) - wi*; Rz(psi) wo(q) - wo*],
///          which is regular at theta_h = 0 and theta_d = 0, where half/difference angles are not;
///          psi starts at the best turn of the tangential parts. Within limits by projection.
NumericSolution descend(const RigDescription& rig, const brdf::DirectionPair& target,
                        const Joints& seed, StayWithinLimits within_limits);

/// Best turn about the normal from one pair to the other (2-D Procrustes).
Angle best_turn(const brdf::DirectionPair& from, const brdf::DirectionPair& to);

}  // namespace gonio::rig
