#include "gonio/design/pose_grid.h"

#include <cmath>
#include <stdexcept>
#include <string>

#include "gonio/parallel/parallel.h"

namespace gonio::design {
namespace {

/// 90 sqrt(theta_h / 90 deg) and back.
double spaced(Angle theta_h) { return 90.0 * std::sqrt(theta_h.degrees() / 90.0); }
Angle unspaced(double t) { return Angle::from_degrees(t * t / 90.0); }

}  // namespace

std::vector<brdf::HalfDiff> pose_grid(double step_deg, const AllowedPose& allowed) {
  if (!(step_deg >= 0.5 && step_deg <= 45.0)) {
    throw std::invalid_argument("pose grid: step is " + std::to_string(step_deg) +
                                " deg, expected 0.5 to 45");
  }
  const auto along = [&](double range) { return static_cast<std::size_t>(range / step_deg); };
  const auto angle = [&](std::size_t i) { return step_deg * (static_cast<double>(i) + 0.5); };
  const std::size_t theta_h_count = along(90.0);
  using Poses = std::vector<brdf::HalfDiff>;
  return parallel::reduce_blocks(
      0, theta_h_count, 1, Poses(),
      [&](std::size_t i, std::size_t) {
        Poses part;
        for (std::size_t j = 0; j < along(90.0); ++j) {
          for (std::size_t k = 0; k < along(180.0); ++k) {
            const brdf::HalfDiff pose{unspaced(angle(i)), Angle::from_degrees(angle(j)),
                                      Angle::from_degrees(angle(k)), Angle()};
            if (!brdf::above_horizon(pose.theta_h, pose.theta_d, pose.phi_d)) continue;
            if (!allowed || allowed(pose)) part.push_back(pose);
          }
        }
        return part;
      },
      [](Poses& all, Poses&& part) { all.insert(all.end(), part.begin(), part.end()); });
}

std::vector<brdf::HalfDiff> poses_around(const brdf::HalfDiff& pose, double step_deg, int reach,
                                         const AllowedPose& allowed) {
  std::vector<brdf::HalfDiff> found;
  for (int a = -reach; a <= reach; ++a) {
    for (int b = -reach; b <= reach; ++b) {
      for (int c = -reach; c <= reach; ++c) {
        const double t = spaced(pose.theta_h) + a * step_deg;
        const double theta_d = pose.theta_d.degrees() + b * step_deg;
        double phi_d = pose.phi_d.degrees() + c * step_deg;
        if (t < 0.0 || t > 90.0 || theta_d < 0.0 || theta_d > 90.0) continue;
        if (phi_d < 0.0) phi_d += 180.0;
        if (phi_d >= 180.0) phi_d -= 180.0;
        const brdf::HalfDiff near{unspaced(t), Angle::from_degrees(theta_d),
                                  Angle::from_degrees(phi_d), Angle()};
        if (!brdf::above_horizon(near.theta_h, near.theta_d, near.phi_d)) continue;
        if (!allowed || allowed(near)) found.push_back(near);
      }
    }
  }
  return found;
}

}  // namespace gonio::design
