#pragma once

#include <vector>

#include "gonio/rig/rig_description.h"

namespace gonio::rig {

/// How a tip moves with one link: angular velocity and velocity of the world's origin carried
/// along, per radian of the axis (the spatial screw).
struct LinkMotion {
  std::size_t axis;
  Eigen::Vector3d turn;             ///< rad per rad, world frame
  Eigen::Vector3d origin_velocity;  ///< mm per rad; a point p of the tip moves with turn x p + this
};

/// Pose of a chain's tip.
Eigen::Isometry3d world_from_tip(const Chain& chain, const Joints& joints);

/// The pose together with the motion by each link, base to tip.
struct ChainState {
  Eigen::Isometry3d world_from_tip;
  std::vector<LinkMotion> motions;
};
ChainState chain_state(const Chain& chain, const Joints& joints);

}  // namespace gonio::rig
