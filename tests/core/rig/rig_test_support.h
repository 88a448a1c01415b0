#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <random>

#include "directions_deg.h"
#include "gonio/rig/kinematics.h"

namespace gonio::rig::test {

inline Angle deg(double degrees) { return Angle::from_degrees(degrees); }

/// Nielsen, Jensen, Ramamoorthi 2015: their ten directions.
inline const std::array<brdf::HalfDiff, 10> kPublishedTen{
    half_diff_deg(3, 12, 28),  half_diff_deg(63, 19, 89), half_diff_deg(5, 77, 77),
    half_diff_deg(2, 60, 180), half_diff_deg(15, 4, 130), half_diff_deg(1, 6, 37),
    half_diff_deg(2, 79, 110), half_diff_deg(39, 76, 89), half_diff_deg(0, 71, 104),
    half_diff_deg(5, 75, 180)};

/// Random numbers that are the same everywhere.
class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}
  double uniform(double min, double max) {
    return min + (max - min) * static_cast<double>(generator_() >> 11) * 0x1p-53;
  }
  Eigen::Vector3d vector(double half_range) {
    const double x = uniform(-half_range, half_range);
    const double y = uniform(-half_range, half_range);
    const double z = uniform(-half_range, half_range);
    return {x, y, z};
  }

 private:
  std::mt19937_64 generator_;
};

/// A random direction above the horizon.
inline brdf::HalfDiff random_direction(Random& random, double theta_d_max_deg) {
  while (true) {
    // The square crowds theta_h towards the pole, where coordinates are delicate.
    const double u = random.uniform(0.0, 1.0);
    const brdf::HalfDiff d = half_diff_deg(90.0 * u * u, random.uniform(0.0, theta_d_max_deg),
                                           random.uniform(-180.0, 180.0));
    if (brdf::above_horizon(d.theta_h, d.theta_d, d.phi_d)) return d;
  }
}

/// Largest difference of wi and wo after the best common turn about the normal: what an isotropic
/// material could notice.
inline double difference(const brdf::DirectionPair& a, const brdf::DirectionPair& b) {
  const auto flat = [](const Eigen::Vector3d& v) { return std::complex(v.x(), v.y()); };
  const std::complex<double> product =
      std::conj(flat(a.wi)) * flat(b.wi) + std::conj(flat(a.wo)) * flat(b.wo);
  const double size = std::abs(product);
  const std::complex<double> turn = size > 0.0 ? product / size : 1.0;
  const auto distance = [&](const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
    return std::hypot(std::abs(turn * flat(from) - flat(to)), from.z() - to.z());
  };
  return std::max(distance(a.wi, b.wi), distance(a.wo, b.wo));
}

inline brdf::DirectionPair exchanged(const brdf::DirectionPair& pair) { return {pair.wo, pair.wi}; }

inline brdf::DirectionPair nominal(const RigDescription& rig, const Joints& joints) {
  return forward(rig, joints).directions_at(Eigen::Vector3d::Zero());
}

/// What the pose was to show: the direction, mirrored and exchanged as its branch says.
inline brdf::DirectionPair wanted(brdf::HalfDiff d, const PoseSolution& pose) {
  if (pose.mirrored) d.phi_d = -d.phi_d;
  const auto pair = brdf::directions_from_half_diff(d);
  return pose.branch == Branch::C || pose.branch == Branch::D ? exchanged(pair) : pair;
}

/// LA-2 that may go anywhere.
inline RigDescription unlimited_la2() {
  RigDescription rig = la2();
  for (Axis& axis : rig.axes) {
    axis.min = deg(-180.0);
    axis.max = deg(180.0);
  }
  rig.limits.theta_i_max = rig.limits.theta_o_max = deg(90.0);
  rig.limits.theta_d_min = Angle();
  return rig;
}

inline Joints joints(std::initializer_list<double> degrees) {
  Joints result;
  for (const double d : degrees) result.push_back(deg(d));
  return result;
}

}  // namespace gonio::rig::test
