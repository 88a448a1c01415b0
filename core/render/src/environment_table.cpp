#include "environment_table.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gonio/parallel/parallel.h"
#include "gonio/render/studio.h"

namespace gonio::render {
namespace {

constexpr float kSharpest = 0.006F;  // radians; half the distance of two azimuths
constexpr int kLevels = 13;          // widths grow by sqrt 2: 0.34 to 22 deg
constexpr int kMostRings = 512;
constexpr int kLeastRings = 64;

}  // namespace

EnvironmentTable::EnvironmentTable(const Radiance& radiance) {
  for (int i = 0; i < kLevels; ++i) {
    const float width = kSharpest * std::pow(2.0F, 0.5F * static_cast<float>(i));
    const int rings = std::clamp(static_cast<int>(4.0 * std::numbers::pi / double{width}),
                                 kLeastRings, kMostRings);
    Level level{width, rings, {}};
    level.entries.resize(static_cast<std::size_t>(rings) * kAzimuths);
    parallel::for_each_block(
        0, static_cast<std::size_t>(rings), 4, [&](std::size_t from, std::size_t to) {
          for (std::size_t ring = from; ring < to; ++ring) {
            const double theta = (static_cast<double>(ring) + 0.5) / rings * std::numbers::pi;
            for (int a = 0; a < kAzimuths; ++a) {
              const double phi = 2.0 * std::numbers::pi * a / kAzimuths;
              const Eigen::Vector3d direction(std::sin(theta) * std::cos(phi),
                                              std::sin(theta) * std::sin(phi), std::cos(theta));
              level.entries[ring * kAzimuths + static_cast<std::size_t>(a)]
                  << radiance(direction, double{width}).cast<float>(),
                  0.0F;
            }
          }
        });
    levels_.push_back(std::move(level));
  }
}

const Eigen::Array4f* EnvironmentTable::ring(float theta_rad, float width_rad) const {
  const float octaves = 2.0F * std::log2(std::max(width_rad, kSharpest) / kSharpest);
  const auto at = static_cast<std::size_t>(std::min(std::lround(octaves), long{kLevels - 1}));
  const Level& level = levels_[at];
  const float position = theta_rad * static_cast<float>(level.rings * std::numbers::inv_pi);
  const int ring = std::clamp(static_cast<int>(position), 0, level.rings - 1);
  return level.entries.data() + static_cast<std::ptrdiff_t>(ring) * kAzimuths;
}

const EnvironmentTable& studio_table() {
  static const EnvironmentTable table([](const Eigen::Vector3d& direction, double width) {
    return studio_radiance(direction, width);
  });
  return table;
}

}  // namespace gonio::render
