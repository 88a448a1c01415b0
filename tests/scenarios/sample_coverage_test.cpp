// Are samples as sure as they say? Two thousand small sessions, each in a world of its own: noise,
// white, lean of the sample and lamp are drawn anew, so that every sample is independent.

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "gonio/brdf/builtin_materials.h"
#include "gonio/brdf/diffuse_models.h"
#include "gonio/random/distributions.h"
#include "gonio/random/stream.h"
#include "simulated_session.h"
#include "temporary_folder.h"

namespace gonio {
namespace {

constexpr std::uint64_t kSessions = 2000;
constexpr double kWhite = 0.9;
constexpr double kWhiteSigma = 0.005;
constexpr double kTiltSigma_deg = 0.1;

/// A camera of few pixels, a sample that leans and a white that is not quite what its certificate
/// says.
sim::SimOptions drawn_world(std::uint64_t seed) {
  random::Stream draw(random::make_key(seed, "sample coverage"));
  const auto material = brdf::builtin_material(seed % 2 == 0 ? "grey-abs" : "slate").model;
  sim::SimOptions world = sim::nominal_options(material, seed);
  world.camera.width_px = 48;
  world.camera.height_px = 40;
  world.camera.fx_px = world.camera.fy_px = 350.0;
  world.camera.cx_px = 23.5;
  world.camera.cy_px = 19.5;
  world.sample_mount.tilt_about_x = Angle::from_degrees(kTiltSigma_deg * draw.normal());
  world.sample_mount.tilt_about_y = Angle::from_degrees(kTiltSigma_deg * draw.normal());
  const double white = kWhite * (1.0 + kWhiteSigma * draw.normal());
  world.scene.white_tile = std::make_shared<brdf::Lambertian>(brdf::Rgb::Constant(white));
  world.scene.patch = world.scene.white_tile;
  return world;
}

std::array<double, 3> drawn_direction(std::uint64_t seed) {
  random::Stream draw(random::make_key(seed, "sample coverage, direction"));
  return {25.0 * draw.uniform(), 8.0 + 40.0 * draw.uniform(), 180.0 * draw.uniform()};
}

struct Deviation {
  double error;
  double sigma;
};

/// One sample of one session against the material, and what it says about itself: noise, what is
/// common to its pose, and its normal.
Deviation deviation_of(std::uint64_t seed) {
  const sim::SimOptions truth = drawn_world(seed);
  instrument::Instrument known = nominal_instrument(truth);
  known.white.reflectance = brdf::Rgb::Constant(kWhite);
  known.white.u_relative = kWhiteSigma;
  known.u_normal = Angle::from_degrees(kTiltSigma_deg);
  acquisition::SessionOptions how;
  how.white_frames = 1;
  how.dark_frames = 2;
  how.relative_sigma = 0.02;
  acquisition::ReductionOptions one;
  one.grid = 1;
  one.spot_half_width_mm = 5.0;
  const TemporaryFolder folder;
  const std::filesystem::path session = folder.path() / "session";
  sim::SimGoniometer world(truth);
  {
    acquisition::SessionWriter archive(session, {}, {});
    acquisition::run_session(devices_of(world), known, plan_of(known, {drawn_direction(seed)}), how,
                             archive);
  }
  const samples::SampleSet set =
      acquisition::reduce(acquisition::SessionReader(session), known, one).samples;
  const samples::Sample& sample = set.samples.at(0);
  const brdf::BrdfModel& material = *truth.scene.sample;
  const brdf::DirectionPair pair = brdf::directions_from_half_diff(sample.direction);
  constexpr int kGreen = 1;
  // What is taken for the BRDF when the normal leans: light falls on it under another angle.
  const auto taken_for = [&](const brdf::DirectionPair& really) {
    return material.evaluate(really)[kGreen] * really.wi.z() / pair.wi.z();
  };
  double variance =
      std::pow(sample.sigma_per_sr[kGreen], 2) + std::pow(sample.u_common_per_sr[kGreen], 2);
  for (const bool about_x : {true, false}) {
    const brdf::TiltedEnds ends = brdf::tilted_ends(pair, sample.u_tilt, about_x);
    variance += std::pow((taken_for(ends.plus) - taken_for(ends.minus)) / ends.steps, 2);
  }
  return {sample.value_per_sr[kGreen] - material.evaluate(pair)[kGreen], std::sqrt(variance)};
}

TEST(SampleCoverage, TwoSigmaHoldWhatTheyShould) {
  int within = 0;
  double squares = 0.0;
  for (std::uint64_t seed = 1; seed <= kSessions; ++seed) {
    const Deviation deviation = deviation_of(seed);
    const double z = deviation.error / deviation.sigma;
    squares += z * z;
    if (std::abs(z) < 2.0) ++within;
  }
  const double share = static_cast<double>(within) / kSessions;
  RecordProperty("within two sigma", std::to_string(share));
  EXPECT_GE(share, 0.93);
  EXPECT_LE(share, 0.97);
  const double chi2_per_dof = squares / kSessions;
  RecordProperty("chi2 per dof", std::to_string(chi2_per_dof));
  EXPECT_GT(chi2_per_dof, 0.8);
  EXPECT_LT(chi2_per_dof, 1.25);
}

}  // namespace
}  // namespace gonio
