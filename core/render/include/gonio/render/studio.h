#pragma once

#include <Eigen/Core>

namespace gonio::render {

/// Light around the sphere in pictures for people: a photographer's studio of our own making, given
/// as a formula: a bright ceiling that falls off to a dark floor, a large softbox to the upper
/// left, a window of four panes to the right, and two strip lights behind that draw the rim.
///
/// `direction`  Unit, from the sphere outwards; x right, y up, z towards the viewer.
/// `width_rad`  The radiance averaged over about so many radians around the direction; 0 for the
///              sharp one. What is lit stays as bright in total whatever the width.
/// Returns      Linear RGB radiance; a white diffuse sphere (albedo 1) comes out near 1 where it is
///              lit well.
Eigen::Array3d studio_radiance(const Eigen::Vector3d& direction, double width_rad = 0.0);

}  // namespace gonio::render
