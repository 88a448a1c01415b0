#include "gonio/quality/synthetic_samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "gonio/random/stream.h"

namespace gonio::quality {
namespace {

// Near the pole phi_d is hardly defined: an uncertainty beyond this says "anything" already.
constexpr Angle kLargestPhiUncertainty = Angle::from_degrees(60.0);

void check(std::span<const brdf::HalfDiff> directions, const SyntheticNoise& noise) {
  if (directions.empty()) throw std::invalid_argument("synthetic samples: no directions");
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const brdf::HalfDiff& at = directions[i];
    if (!brdf::above_horizon(at.theta_h, at.theta_d, at.phi_d)) {
      throw std::invalid_argument("synthetic samples: direction " + std::to_string(i + 1) +
                                  " is below the horizon");
    }
  }
  const auto bad = [](double x) { return !(x >= 0.0 && std::isfinite(x)); };
  if (bad(noise.relative) || bad(noise.common_relative) || bad(noise.normal_tilt.radians())) {
    throw std::invalid_argument("synthetic samples: noise must be finite and not negative");
  }
}

brdf::DirectionPair tilted(const brdf::DirectionPair& pair, Angle about_x, Angle about_y) {
  const Eigen::Matrix3d turn = (Eigen::AngleAxisd(about_x.radians(), Eigen::Vector3d::UnitX()) *
                                Eigen::AngleAxisd(about_y.radians(), Eigen::Vector3d::UnitY()))
                                   .toRotationMatrix();
  return {turn * pair.wi, turn * pair.wo};
}

/// How far a tilt of one sigma about either axis moves the angles, added in quadrature.
void set_angle_uncertainty(samples::Sample& sample, const brdf::DirectionPair& pair, Angle tilt) {
  double theta_h = 0.0;
  double theta_d = 0.0;
  double phi_d = 0.0;
  const brdf::HalfDiff from = brdf::half_diff_from_directions(pair);
  for (const brdf::DirectionPair& moved :
       {tilted(pair, tilt, Angle()), tilted(pair, Angle(), tilt)}) {
    const brdf::HalfDiff to = brdf::half_diff_from_directions(moved);
    theta_h = std::hypot(theta_h, (to.theta_h - from.theta_h).radians());
    theta_d = std::hypot(theta_d, (to.theta_d - from.theta_d).radians());
    phi_d = std::hypot(phi_d, wrap_to_half_turn(to.phi_d - from.phi_d).radians());
  }
  sample.u_theta_h = Angle::from_radians(theta_h);
  sample.u_theta_d = Angle::from_radians(theta_d);
  sample.u_phi_d = std::min(Angle::from_radians(phi_d), kLargestPhiUncertainty);
}

/// One value of a pose.
struct Glimpse {
  brdf::HalfDiff direction;  ///< as the sample says it
  brdf::DirectionPair pair;
  int spot = -1;
  double noise_share = 1.0;  ///< of noise.relative: a mean of pixels has less
};

/// Adds the samples of one pose.
void add_pose(const brdf::BrdfModel& truth, const std::vector<Glimpse>& glimpses,
              const SyntheticNoise& noise, int pose, random::Stream& draw,
              samples::SampleSet& set) {
  const auto normal3 = [&] {
    const double r = draw.normal();
    const double g = draw.normal();
    return brdf::Rgb(r, g, draw.normal());
  };
  const Angle about_x = draw.normal() * noise.normal_tilt;
  const Angle about_y = draw.normal() * noise.normal_tilt;
  const brdf::Rgb common = 1.0 + noise.common_relative * normal3();
  for (const Glimpse& glimpse : glimpses) {
    const double relative = glimpse.noise_share * noise.relative;
    const brdf::Rgb independent = 1.0 + relative * normal3();
    samples::Sample sample;
    sample.direction = glimpse.direction;
    sample.value_per_sr =
        truth.evaluate(tilted(glimpse.pair, about_x, about_y)) * common * independent;
    sample.sigma_per_sr = relative * sample.value_per_sr.abs();
    sample.u_common_per_sr = noise.common_relative * sample.value_per_sr.abs();
    if (noise.normal_tilt > Angle()) {
      set_angle_uncertainty(sample, glimpse.pair, noise.normal_tilt);
    }
    sample.pose = pose;
    sample.spot = glimpse.spot;
    set.samples.push_back(std::move(sample));
  }
}

}  // namespace

samples::SampleSet synthetic_samples(const brdf::BrdfModel& truth, brdf::RadiometricScale scale,
                                     std::span<const brdf::HalfDiff> directions,
                                     const PatchGeometry& patch, const SyntheticNoise& noise,
                                     std::uint64_t seed, std::uint64_t stream) {
  check(directions, noise);
  patch.validate();
  random::Stream draw(random::make_key(seed, "quality.synthetic_samples", stream));
  samples::SampleSet set;
  set.scale = scale;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    std::vector<Glimpse> glimpses;
    for (const brdf::DirectionPair& pair : design::patch_pairs(directions[i], patch)) {
      Glimpse glimpse{directions[i], pair, -1, 1.0};
      if (!patch.is_point()) {
        glimpse.direction = brdf::half_diff_from_directions(pair);
        glimpse.spot = static_cast<int>(glimpses.size());
      }
      glimpse.direction.phi_h = Angle();
      glimpses.push_back(std::move(glimpse));
    }
    add_pose(truth, glimpses, noise, static_cast<int>(i), draw, set);
  }
  return set;
}

samples::SampleSet near_field_samples(const brdf::BrdfModel& truth, brdf::RadiometricScale scale,
                                      std::span<const brdf::HalfDiff> shots,
                                      const design::NearFieldSetup& setup,
                                      const SyntheticNoise& noise, std::uint64_t seed,
                                      std::uint64_t stream) {
  check(shots, noise);
  random::Stream draw(random::make_key(seed, "quality.near_field_samples", stream));
  samples::SampleSet set;
  set.scale = scale;
  for (std::size_t i = 0; i < shots.size(); ++i) {
    std::vector<Glimpse> glimpses;
    for (const design::NearFieldBin& bin : design::near_field_view(shots[i], setup).bins) {
      glimpses.push_back({bin.direction, brdf::directions_from_half_diff(bin.direction), -1,
                          1.0 / std::sqrt(static_cast<double>(bin.pixels))});
    }
    add_pose(truth, glimpses, noise, static_cast<int>(i), draw, set);
  }
  if (set.samples.empty()) {
    throw std::invalid_argument("near field: no pixel of any shot is usable");
  }
  return set;
}

}  // namespace gonio::quality
