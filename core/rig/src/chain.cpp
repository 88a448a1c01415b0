#include "chain.h"

#include <numbers>

namespace gonio::rig {
namespace {

/// Angle of a link for its axis' joint angle.
Angle turn_of(const ChainLink& link, const Joints& joints) {
  return link.scale * joints[link.axis] + link.offset;
}

bool is_slide(const ChainLink& link) { return link.lead_mm_per_turn != 0.0; }

double mm_per_radian(const ChainLink& link) {
  return link.lead_mm_per_turn / (2.0 * std::numbers::pi);
}

/// Exponential of the link's screw.
Eigen::Isometry3d displacement(const ChainLink& link, Angle turn) {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  if (is_slide(link)) {
    motion.translation() = mm_per_radian(link) * turn.radians() * link.direction;
    return motion;
  }
  // Rodrigues with sin and cos of the given angle: Eigen's AngleAxis does the same.
  motion.linear() = Eigen::AngleAxisd(turn.radians(), link.direction).toRotationMatrix();
  motion.translation() = link.point_mm - motion.linear() * link.point_mm;
  return motion;
}

}  // namespace

Eigen::Isometry3d world_from_tip(const Chain& chain, const Joints& joints) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (const ChainLink& link : chain.links) pose = pose * displacement(link, turn_of(link, joints));
  return pose * chain.home_pose;
}

ChainState chain_state(const Chain& chain, const Joints& joints) {
  ChainState state;
  state.motions.reserve(chain.links.size());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (const ChainLink& link : chain.links) {
    const Eigen::Vector3d direction = pose.linear() * link.direction;
    if (is_slide(link)) {
      state.motions.push_back(
          {link.axis, Eigen::Vector3d::Zero(), link.scale * mm_per_radian(link) * direction});
    } else {
      const Eigen::Vector3d turn = link.scale * direction;
      state.motions.push_back({link.axis, turn, (pose * link.point_mm).cross(turn)});
    }
    pose = pose * displacement(link, turn_of(link, joints));
  }
  state.world_from_tip = pose * chain.home_pose;
  return state;
}

}  // namespace gonio::rig
