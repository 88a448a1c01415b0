#pragma once

#include <Eigen/Core>

#include "gonio/rig/rig_description.h"

namespace gonio::calibration::geometry {

/// Slope (h_x / h_z, h_y / h_z) of the half vector in the sample's frame at a point of the sample;
/// not a number behind the horizon.
Eigen::Vector2d half_slope(const rig::RigDescription& rig, const rig::Joints& joints,
                           const Eigen::Vector3d& point_in_sample_mm);

/// Its derivative by one joint, per radian.
Eigen::Vector2d half_slope_by_joint(const rig::RigDescription& rig, const rig::Joints& joints,
                                    const Eigen::Vector3d& point_in_sample_mm, std::size_t axis);

/// Throws StepRefused, beginning with `step`, unless the rig is an LA-2 with its lamp on one link.
void require_la2_with_lamp(const char* step, const rig::RigDescription& rig);

}  // namespace gonio::calibration::geometry
