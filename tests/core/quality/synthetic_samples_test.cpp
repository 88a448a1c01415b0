#include "gonio/quality/synthetic_samples.h"
#include "directions_deg.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace gonio::quality {
namespace {

using brdf::HalfDiff;
using brdf::Rgb;

constexpr double kRounding = 1e-12;
constexpr std::size_t kMany = 20000;
constexpr double kSpreadTolerance = 0.03;  // 20,000 draws know their spread to 0.5 %

/// f = a constant plus cos theta_i: tells the light from the detector.
class LightCosine final : public brdf::BrdfModel {
  Rgb evaluate_visible(const brdf::ShadingGeometry& geometry) const override {
    return Rgb(1.0, 2.0, 3.0) + geometry.cos_theta_i;
  }
};

double spread(const std::vector<double>& values) {
  double sum = 0.0;
  double square = 0.0;
  for (const double value : values) {
    sum += value;
    square += value * value;
  }
  const double n = static_cast<double>(values.size());
  return std::sqrt(square / n - sum * sum / (n * n));
}

TEST(SyntheticSamples, AreTheModelItselfWithoutNoise) {
  const std::vector<HalfDiff> directions = {half_diff_deg(10, 30, 70), half_diff_deg(40, 5, 120)};
  const samples::SampleSet set =
      synthetic_samples(LightCosine(), brdf::RadiometricScale::merl, directions);
  ASSERT_EQ(set.samples.size(), 2u);
  EXPECT_EQ(set.scale, brdf::RadiometricScale::merl);
  for (std::size_t i = 0; i < 2; ++i) {
    const samples::Sample& sample = set.samples[i];
    const double cos_i = brdf::directions_from_half_diff(directions[i]).wi.z();
    EXPECT_NEAR(sample.value_per_sr[1], 2.0 + cos_i, kRounding);
    EXPECT_EQ(sample.direction.theta_h, directions[i].theta_h);
    EXPECT_TRUE((sample.sigma_per_sr == 0.0).all());
    EXPECT_EQ(sample.u_theta_h, Angle());
  }
}

TEST(SyntheticSamples, CarryTheSizeOfTheNoiseTheyWereDrawnWith) {
  const std::vector<HalfDiff> directions(kMany, half_diff_deg(20, 30, 60));
  SyntheticNoise noise;
  noise.relative = 0.03;
  const samples::SampleSet set =
      synthetic_samples(LightCosine(), brdf::RadiometricScale::si, directions, {}, noise);
  const double truth = 1.0 + brdf::directions_from_half_diff(directions[0]).wi.z();
  std::vector<double> red;
  for (const samples::Sample& sample : set.samples) red.push_back(sample.value_per_sr[0] / truth);
  EXPECT_NEAR(spread(red) / 0.03, 1.0, kSpreadTolerance);
  EXPECT_NEAR(set.samples[0].sigma_per_sr[0] / set.samples[0].value_per_sr[0], 0.03, kRounding);
  EXPECT_NE(set.samples[0].value_per_sr[0], set.samples[1].value_per_sr[0]);
}

TEST(SyntheticSamples, ShareCommonNoiseWithinAPoseAndNotBetweenPoses) {
  SyntheticNoise noise;
  noise.common_relative = 0.05;
  PatchGeometry patch;
  patch.half_width_mm = 1e-6;  // nine samples of the same direction
  const std::vector<HalfDiff> directions = {half_diff_deg(20, 30, 60), half_diff_deg(20, 30, 60)};
  const samples::SampleSet set =
      synthetic_samples(LightCosine(), brdf::RadiometricScale::si, directions, patch, noise);
  ASSERT_EQ(set.samples.size(), 18u);
  constexpr double kPatchWidth = 1e-7;  // what a micrometre changes
  for (std::size_t i = 0; i < 18; ++i) {
    EXPECT_EQ(set.samples[i].pose, i < 9 ? 0 : 1);
    EXPECT_NEAR(set.samples[i].value_per_sr[2], set.samples[i < 9 ? 0 : 9].value_per_sr[2],
                kPatchWidth);
  }
  EXPECT_GT(std::abs(set.samples[0].value_per_sr[2] - set.samples[9].value_per_sr[2]), 1e-3);
}

TEST(SyntheticSamples, PatchSpreadsDirectionsByItsWidthOverTheDistance) {
  PatchGeometry patch;
  patch.half_width_mm = 30.0;
  patch.grid = 3;  // centres at -20, 0, 20 mm
  patch.camera_distance_mm = 1000.0;
  patch.lamp_distance_mm = 500.0;
  const std::vector<HalfDiff> directions = {
      half_diff_deg(0.0, 1.0, 0.0)};  // both nearly along the normal
  const samples::SampleSet set =
      synthetic_samples(LightCosine(), brdf::RadiometricScale::si, directions, patch);
  ASSERT_EQ(set.samples.size(), 9u);
  EXPECT_NEAR(set.samples[4].direction.theta_d.degrees(), 1.0, 1e-9);
  // At the middle of the left edge (x = -20 mm) the half vector leans by the mean of 20/500 and
  // 20/1000 rad towards +x.
  EXPECT_NEAR(set.samples[3].direction.theta_h.radians(), 0.030, 3e-4);  // second order in 0.04
}

TEST(SyntheticSamples, StayAboveTheHorizonWithCameraAndLampNearTheSamplesEdge) {
  PatchGeometry patch;
  patch.half_width_mm = 50.0;
  patch.camera_distance_mm = patch.lamp_distance_mm = 60.0;
  const std::vector<HalfDiff> directions = {half_diff_deg(2.0, 87.0, 5.0)};
  const samples::SampleSet set =
      synthetic_samples(LightCosine(), brdf::RadiometricScale::si, directions, patch);
  EXPECT_EQ(set.samples.size(), 9u);  // all of a 3 x 3 patch
  for (const samples::Sample& sample : set.samples) {
    const brdf::DirectionPair pair = brdf::directions_from_half_diff(sample.direction);
    EXPECT_GT(pair.wi.z(), 0.0);
    EXPECT_GT(pair.wo.z(), 0.0);
  }
}

TEST(SyntheticSamples, TiltMovesTheTruthAndIsTold) {
  SyntheticNoise noise;
  noise.normal_tilt = Angle::from_degrees(0.5);
  const std::vector<HalfDiff> directions(kMany, half_diff_deg(30, 40, 0));  // theta_i = 70 deg
  const samples::SampleSet set =
      synthetic_samples(LightCosine(), brdf::RadiometricScale::si, directions, {}, noise);
  std::vector<double> cosines;
  for (const samples::Sample& sample : set.samples) cosines.push_back(sample.value_per_sr[0]);
  // d cos theta_i = sin theta_i d theta_i, the tilt in the plane of incidence being 0.5 deg rms.
  const double sin_i =
      std::sqrt(1.0 - std::pow(brdf::directions_from_half_diff(directions[0]).wi.z(), 2));
  EXPECT_NEAR(spread(cosines) / (sin_i * noise.normal_tilt.radians()), 1.0, kSpreadTolerance);
  const samples::Sample& sample = set.samples[0];
  EXPECT_EQ(sample.direction.theta_h, directions[0].theta_h);  // the draw stays hidden
  EXPECT_EQ(sample.u_tilt, noise.normal_tilt);
  EXPECT_EQ(sample.u_theta_h, Angle()) << "told twice";
}

TEST(SyntheticSamples, SubSamplesOfAPoseLieAroundItsCentre) {
  PatchGeometry patch;
  patch.half_width_mm = 25.0;
  const samples::SampleSet set = synthetic_samples(LightCosine(), brdf::RadiometricScale::si,
                                                   {{half_diff_deg(1, 20, 40)}}, patch);
  // As vectors the directions are as even as the grid: their mean is the middle one.
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const samples::Sample& sample : set.samples) {
    mean += brdf::directions_from_half_diff(sample.direction).wo / 9.0;
  }
  ASSERT_EQ(set.samples.size(), 9u);
  EXPECT_LT((mean - brdf::directions_from_half_diff(set.samples[4].direction).wo).norm(), 5e-3);
}

TEST(SyntheticSamples, AreTheSameForTheSameSeedAndStreamOnly) {
  SyntheticNoise noise;
  noise.relative = 0.1;
  const std::vector<HalfDiff> directions = {half_diff_deg(20, 30, 60)};
  const auto draw = [&](std::uint64_t seed, std::uint64_t stream) {
    return synthetic_samples(LightCosine(), brdf::RadiometricScale::si, directions, {}, noise, seed,
                             stream)
        .samples[0]
        .value_per_sr[0];
  };
  EXPECT_EQ(draw(1, 0), draw(1, 0));
  EXPECT_NE(draw(1, 0), draw(2, 0));
  EXPECT_NE(draw(1, 0), draw(1, 1));
}

TEST(SyntheticSamples, RefuseNonsense) {
  const auto make = [](const std::vector<HalfDiff>& directions, const PatchGeometry& patch,
                       const SyntheticNoise& noise) {
    return synthetic_samples(LightCosine(), brdf::RadiometricScale::si, directions, patch, noise);
  };
  const std::vector<HalfDiff> good = {half_diff_deg(20, 30, 60)};
  EXPECT_THROW(make({}, {}, {}), std::invalid_argument);
  EXPECT_THROW(make({half_diff_deg(20, 89, 0)}, {}, {}), std::invalid_argument);
  SyntheticNoise negative;
  negative.relative = -0.1;
  EXPECT_THROW(make(good, {}, negative), std::invalid_argument);
  PatchGeometry no_grid;
  no_grid.grid = 0;
  EXPECT_THROW(make(good, no_grid, {}), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::quality
