#pragma once

#include "gonio/rig/kinematics.h"

namespace gonio::rig {

/// Directions at the sample origin and their derivatives by every joint (3 x axes, per radian).
struct DirectionJacobian {
  brdf::DirectionPair pair;
  Eigen::Matrix3Xd d_wi;
  Eigen::Matrix3Xd d_wo;
};

/// From the spatial screws of the three chains, no differences taken.
DirectionJacobian direction_jacobian(const RigDescription& rig, const Joints& joints);

}  // namespace gonio::rig
