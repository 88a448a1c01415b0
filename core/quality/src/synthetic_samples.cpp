#include "gonio/quality/synthetic_samples.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "gonio/random/stream.h"

namespace gonio::quality {
namespace {

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
        truth.evaluate(brdf::tilted(glimpse.pair, about_x, about_y)) * common * independent;
    sample.sigma_per_sr = relative * sample.value_per_sr.abs();
    sample.u_common_per_sr = noise.common_relative * sample.value_per_sr.abs();
    sample.u_tilt = noise.normal_tilt;
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
  if (noise.normal_tilt > Angle()) {
    throw std::invalid_argument(
        "near field: a tilt of the normal is not simulated: its bins do not know how they lie to "
        "each other");
  }
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
