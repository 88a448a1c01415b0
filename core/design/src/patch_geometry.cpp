#include "gonio/design/patch_geometry.h"

#include <cmath>
#include <stdexcept>
#include <string>

namespace gonio::design {
namespace {

constexpr int kLargestGrid = 99;

}  // namespace

PatchGeometry PatchGeometry::of_half_width(double half_width_mm) {
  constexpr double kLargestSquare_mm = 10.0;
  constexpr int kLargestUsualGrid = 7;
  PatchGeometry patch;
  patch.half_width_mm = half_width_mm;
  while (patch.grid < kLargestUsualGrid && 2.0 * half_width_mm > patch.grid * kLargestSquare_mm) {
    patch.grid += 2;
  }
  return patch;
}

PatchGeometry PatchGeometry::coarse() const {
  if (is_point() || grid <= 3) return *this;
  PatchGeometry patch = *this;
  patch.grid = 3;
  patch.half_width_mm = half_width_mm * (grid - 1.0) / grid * 1.5;
  return patch;
}

void PatchGeometry::validate() const {
  const auto refuse = [](const std::string& why) { throw std::invalid_argument("patch: " + why); };
  if (!(half_width_mm >= 0.0 && std::isfinite(half_width_mm))) {
    refuse("half_width_mm is " + std::to_string(half_width_mm) + ", expected 0 or more");
  }
  if (grid < 1 || grid > kLargestGrid) {
    refuse("grid is " + std::to_string(grid) + ", expected 1 to " + std::to_string(kLargestGrid));
  }
  const auto far = [](double distance) { return distance > 0.0 && std::isfinite(distance); };
  if (!is_point() && !(far(camera_distance_mm) && far(lamp_distance_mm))) {
    refuse("camera_distance_mm and lamp_distance_mm must be above 0 and finite");
  }
}

std::vector<brdf::DirectionPair> patch_pairs(const brdf::HalfDiff& centre,
                                             const PatchGeometry& patch) {
  brdf::HalfDiff nominal = centre;
  nominal.phi_h = Angle();
  const brdf::DirectionPair pair = brdf::directions_from_half_diff(nominal);
  if (patch.is_point()) return {pair};
  const auto along = [&](int i) {
    return patch.half_width_mm * (2.0 * i + 1.0 - patch.grid) / patch.grid;
  };
  std::vector<brdf::DirectionPair> pairs;
  pairs.reserve(static_cast<std::size_t>(patch.sub_samples()));
  for (int row = 0; row < patch.grid; ++row) {
    for (int column = 0; column < patch.grid; ++column) {
      const Eigen::Vector3d at(along(column), along(row), 0.0);
      pairs.push_back({(patch.lamp_distance_mm * pair.wi - at).normalized(),
                       (patch.camera_distance_mm * pair.wo - at).normalized()});
    }
  }
  return pairs;
}

std::vector<brdf::HalfDiff> patch_directions(const brdf::HalfDiff& centre,
                                             const PatchGeometry& patch) {
  std::vector<brdf::HalfDiff> directions;
  if (patch.is_point()) {
    directions.push_back(centre);
    directions.back().phi_h = Angle();
    return directions;
  }
  for (const brdf::DirectionPair& pair : patch_pairs(centre, patch)) {
    directions.push_back(brdf::half_diff_from_directions(pair));
    directions.back().phi_h = Angle();
  }
  return directions;
}

}  // namespace gonio::design
