#include "direction_jacobian.h"

#include "chain.h"

namespace gonio::rig {
namespace {

/// Adds sign * (velocity of the chain's tip origin) per radian of each axis.
void add_tip_velocities(const ChainState& chain, double sign, Eigen::Matrix3Xd& velocities) {
  const Eigen::Vector3d tip = chain.world_from_tip.translation();
  for (const LinkMotion& motion : chain.motions) {
    velocities.col(static_cast<Eigen::Index>(motion.axis)) +=
        sign * (motion.turn.cross(tip) + motion.origin_velocity);
  }
}

/// The derivative of a vector v/|v| seen from the sample, for v's derivative in the world.
Eigen::Matrix3Xd seen_from_sample(const ChainState& sample, const Eigen::Vector3d& unit,
                                  double length, const Eigen::Matrix3Xd& velocities) {
  // The component along v only changes its length.
  Eigen::Matrix3Xd change = (velocities - unit * (unit.transpose() * velocities)) / length;
  for (const LinkMotion& motion : sample.motions) {
    change.col(static_cast<Eigen::Index>(motion.axis)) -= motion.turn.cross(unit);
  }
  return sample.world_from_tip.linear().transpose() * change;
}

}  // namespace

DirectionJacobian direction_jacobian(const RigDescription& rig, const Joints& joints) {
  const ChainState camera = chain_state(rig.camera, joints);
  const ChainState lamp = chain_state(rig.lamp, joints);
  const ChainState sample = chain_state(rig.sample, joints);
  const auto axes = static_cast<Eigen::Index>(rig.axes.size());
  const Eigen::Vector3d origin = sample.world_from_tip.translation();
  const Eigen::Matrix3d sample_from_world = sample.world_from_tip.linear().transpose();

  Eigen::Vector3d to_lamp = lamp.world_from_tip.translation() - origin;
  Eigen::Matrix3Xd lamp_velocity = Eigen::Matrix3Xd::Zero(3, axes);
  if (rig.collimated_lamp) {
    to_lamp = -lamp.world_from_tip.linear().col(2);
    for (const LinkMotion& motion : lamp.motions) {
      lamp_velocity.col(static_cast<Eigen::Index>(motion.axis)) += motion.turn.cross(to_lamp);
    }
  } else {
    add_tip_velocities(lamp, 1.0, lamp_velocity);
    add_tip_velocities(sample, -1.0, lamp_velocity);
  }
  const Eigen::Vector3d to_camera = camera.world_from_tip.translation() - origin;
  Eigen::Matrix3Xd camera_velocity = Eigen::Matrix3Xd::Zero(3, axes);
  add_tip_velocities(camera, 1.0, camera_velocity);
  add_tip_velocities(sample, -1.0, camera_velocity);

  const Eigen::Vector3d wi = to_lamp.normalized();
  const Eigen::Vector3d wo = to_camera.normalized();
  return {{sample_from_world * wi, sample_from_world * wo},
          seen_from_sample(sample, wi, to_lamp.norm(), lamp_velocity),
          seen_from_sample(sample, wo, to_camera.norm(), camera_velocity)};
}

}  // namespace gonio::rig
