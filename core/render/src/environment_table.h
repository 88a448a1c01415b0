#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

namespace gonio::render {

/// An environment sampled on rings around the viewing axis, at several widths of averaging.
///
/// Rings, because turning the sphere's picture about the viewing axis is then a shift along a row.
class EnvironmentTable {
 public:
  static constexpr int kAzimuths = 768;
  /// Radiance around `direction`, averaged over `width_rad`.
  using Radiance =
      std::function<Eigen::Array3d(const Eigen::Vector3d& direction, double width_rad)>;

  explicit EnvironmentTable(const Radiance& radiance);

  /// kAzimuths entries (r, g, b, 0) of the ring nearest to polar angle `theta_rad` from the viewing
  /// axis, averaged over about `width_rad`; entry i stands at azimuth 2 pi i / kAzimuths.
  const Eigen::Array4f* ring(float theta_rad, float width_rad) const;

 private:
  struct Level {
    float width_rad;
    int rings;
    std::vector<Eigen::Array4f> entries;
  };
  std::vector<Level> levels_;
};

/// The studio's table, built at the first call.
const EnvironmentTable& studio_table();

}  // namespace gonio::render
