#include <stdexcept>
#include <string>

#include "chain.h"
#include "gonio/rig/kinematics.h"

namespace gonio::rig {

brdf::DirectionPair RigPose::directions_at(const Eigen::Vector3d& point_in_sample_mm) const {
  const Eigen::Matrix3d sample_from_world = world_from_sample.linear().transpose();
  const Eigen::Vector3d point = world_from_sample * point_in_sample_mm;
  const Eigen::Vector3d to_lamp = collimated_lamp
                                      ? Eigen::Vector3d(-world_from_lamp.linear().col(2))
                                      : Eigen::Vector3d(world_from_lamp.translation() - point);
  const Eigen::Vector3d to_camera = world_from_camera.translation() - point;
  return {sample_from_world * to_lamp.normalized(), sample_from_world * to_camera.normalized()};
}

RigPose forward(const RigDescription& rig, const Joints& joints) {
  if (joints.size() != rig.axes.size()) {
    throw std::invalid_argument("forward: found " + std::to_string(joints.size()) +
                                " joint angles, expected " + std::to_string(rig.axes.size()));
  }
  return {world_from_tip(rig.camera, joints), world_from_tip(rig.lamp, joints),
          world_from_tip(rig.sample, joints), rig.collimated_lamp};
}

}  // namespace gonio::rig
