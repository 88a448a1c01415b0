#pragma once

#include <Eigen/Core>
#include <string_view>
#include <vector>

namespace gonio::render {

/// A light so far away that only its direction counts.
///
/// Frame    The sphere's own: x right, y up, z towards the viewer.
struct DirectionalLight {
  Eigen::Vector3d direction;  ///< unit, from the sphere towards the light
  double irradiance;          ///< on a surface that faces it, arbitrary unit, same in R, G, B
};

/// The two lightings every quoted image error is measured under.
///   a  160 directions of soft light, brighter from above, and four lamps
///   b  the same 160 directions, even and dim, six of them bright
enum class MetricLighting { a, b };

std::string_view to_string(MetricLighting lighting);  ///< "A", "B"

/// The lights, in a fixed order. Built once and shared.
const std::vector<DirectionalLight>& lights_of(MetricLighting lighting);

}  // namespace gonio::render
