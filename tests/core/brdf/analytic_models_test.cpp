#include "gonio/brdf/analytic_models.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <stdexcept>

#include "albedo_quadrature.h"
#include "reference_values.h"

namespace gonio::brdf {
namespace {

using literals::operator""_deg;
using testing::directional_albedo;
using testing::kCurveError;
using testing::kGold;
using testing::kQuadrature;
using testing::kRounding;
using testing::kSilver;

/// Reflects all but 1e-3 at any angle.
const RefractiveIndex kMirror{Rgb::Constant(0.01), Rgb::Constant(10.0)};

ShiftedGamma::Parameters satin_lobe() {
  return {.rho = {0.6, 0.5, 0.7},
          .alpha = {0.15, 0.10, 0.20},
          .p = {0.8, 0.9, 1.0},
          .f0 = {0.5, 0.4, 0.3},
          .f1 = {0.05, 0.0, 0.02},
          .lambda = {1.0, 1.0, 0.8},
          .c_g = {0.04, 0.045, 0.04},
          .k_g = {6.0, 6.2, 6.0},
          .theta0 = {0.0, 0.1, -0.1}};
}

struct NamedModel {
  std::string name;
  std::shared_ptr<const BrdfModel> model;
};

std::vector<NamedModel> all_models() {
  const Coat tinted{1.5, {0.1, 0.4, 0.8}};
  std::vector<NamedModel> models = {
      {"Lambertian", std::make_shared<Lambertian>(Rgb(0.9, 0.5, 1.0))},
      {"RoughDiffuse", std::make_shared<RoughDiffuse>(Rgb(1.0, 0.6, 0.2), 1.0)},
      {"VolumeForward", std::make_shared<VolumeScatter>(Rgb(1.0, 0.7, 0.3), 0.6)},
      {"VolumeBackward", std::make_shared<VolumeScatter>(Rgb(1.0, 0.7, 0.3), -0.4)},
      {"Sheen", std::make_shared<Sheen>(0.3, Rgb(1.0, 0.5, 0.2))},
      {"Backscatter", std::make_shared<Backscatter>(Rgb(0.8, 0.5, 0.2), 0.2)},
      {"GgxGold", std::make_shared<Ggx>(0.1, kGold)},
      {"GgxRoughSilver", std::make_shared<Ggx>(0.9, kSilver)},
      {"GgxGlass", std::make_shared<Ggx>(0.05, dielectric(1.5))},
      {"AbcLobe", std::make_shared<AbcLobe>(AbcLobe::normalised(60.0, 1.4, kGold))},
      {"ShiftedGamma", std::make_shared<ShiftedGamma>(satin_lobe())},
      {"CoatedDiffuse", std::make_shared<CoatedDiffuse>(tinted, Rgb(0.95, 0.6, 0.3), 0.7)},
      {"CoatedMetal", std::make_shared<CoatedMetal>(tinted, 0.2, kGold)},
  };
  models.push_back({"Mixture", std::make_shared<Mixture>(std::vector<Mixture::Part>{
                                   {Rgb(0.5, 0.3, 0.2), models[0].model},
                                   {Rgb(0.5, 0.7, 0.8), models[6].model}})});
  return models;
}

class EveryModel : public ::testing::TestWithParam<NamedModel> {};

DirectionPair random_pair(std::mt19937_64& random) {
  std::uniform_real_distribution<double> cosine(1e-3, 1.0);
  std::uniform_real_distribution<double> azimuth(-180.0, 180.0);
  const auto draw = [&] {
    return direction(Angle::from_radians(std::acos(cosine(random))),
                     Angle::from_degrees(azimuth(random)));
  };
  const Eigen::Vector3d wi = draw();
  return {wi, draw()};
}

double relative_difference(const Rgb& a, const Rgb& b) {
  return ((a - b).abs() / (a.abs() + b.abs() + 1e-30)).maxCoeff();
}

constexpr double kManySums = 1e-10;  // relative; sharp lobes amplify rounding of theta_h

TEST_P(EveryModel, IsTheSameWithLightAndDetectorExchanged) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 2000; ++i) {
    const DirectionPair pair = random_pair(random);
    const Rgb there = GetParam().model->evaluate(pair);
    const Rgb back = GetParam().model->evaluate(DirectionPair{pair.wo, pair.wi});
    ASSERT_LT(relative_difference(there, back), kManySums) << i;
  }
}

TEST_P(EveryModel, IsTheSameFromVectorsAndFromAngles) {
  std::mt19937_64 random(2);
  for (int i = 0; i < 500; ++i) {
    const DirectionPair pair = random_pair(random);
    const Rgb from_vectors = GetParam().model->evaluate(pair);
    const Rgb from_angles =
        GetParam().model->evaluate(shading_geometry(half_diff_from_directions(pair)));
    ASSERT_LT(relative_difference(from_vectors, from_angles), kManySums) << i;
  }
}

TEST_P(EveryModel, DoesNotDependOnTheSamplesAzimuth) {
  std::mt19937_64 random(3);
  const Eigen::Matrix3d turn =
      (Eigen::Matrix3d() << 0.6, -0.8, 0.0, 0.8, 0.6, 0.0, 0.0, 0.0, 1.0).finished();
  for (int i = 0; i < 500; ++i) {
    const DirectionPair pair = random_pair(random);
    const DirectionPair turned{turn * pair.wi, turn * pair.wo};
    ASSERT_LT(
        relative_difference(GetParam().model->evaluate(pair), GetParam().model->evaluate(turned)),
        kManySums);
  }
}

TEST_P(EveryModel, ReflectsNoMoreThanItReceives) {
  for (const double theta_i : {0.0, 25.0, 50.0, 70.0, 82.0, 88.0}) {
    const Rgb albedo = directional_albedo(*GetParam().model, Angle::from_degrees(theta_i));
    EXPECT_LE(albedo.maxCoeff(), 1.0 + kQuadrature) << "theta_i " << theta_i;
    EXPECT_GE(albedo.minCoeff(), 0.0);
  }
}

TEST_P(EveryModel, IsNeitherNegativeNorInfiniteUpToTheHorizon) {
  std::mt19937_64 random(4);
  for (int i = 0; i < 2000; ++i) {
    const Rgb value = GetParam().model->evaluate(random_pair(random));
    ASSERT_TRUE(value.isFinite().all());
    ASSERT_GE(value.minCoeff(), 0.0);
  }
}

TEST_P(EveryModel, IsZeroBelowTheHorizon) {
  const Eigen::Vector3d above = direction(40.0_deg, 10.0_deg);
  const Eigen::Vector3d below = direction(95.0_deg, 190.0_deg);
  EXPECT_EQ(GetParam().model->evaluate(DirectionPair{above, below}).maxCoeff(), 0.0);
  EXPECT_EQ(GetParam().model->evaluate(DirectionPair{below, above}).maxCoeff(), 0.0);
  EXPECT_GT(GetParam().model->evaluate(DirectionPair{above, above}).minCoeff(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Analytic, EveryModel, ::testing::ValuesIn(all_models()),
                         [](const auto& tested) { return tested.param.name; });

TEST(ShadingGeometry, HoldsThePolarCosinesOfItsDirections) {
  std::mt19937_64 random(5);
  for (int i = 0; i < 500; ++i) {
    const DirectionPair pair = random_pair(random);
    const ShadingGeometry g = shading_geometry(half_diff_from_directions(pair));
    ASSERT_NEAR(g.cos_theta_i, pair.wi.z(), kRounding);
    ASSERT_NEAR(g.cos_theta_o, pair.wo.z(), kRounding);
    ASSERT_NEAR(2.0 * g.cos_theta_d * g.cos_theta_d - 1.0, pair.wi.dot(pair.wo), kRounding);
  }
}

TEST(Lambertian, HasItsAlbedo) {
  const Rgb albedo = directional_albedo(Lambertian({0.9, 0.5, 0.1}), 30.0_deg);
  EXPECT_NEAR((albedo - Rgb(0.9, 0.5, 0.1)).abs().maxCoeff(), 0.0, kQuadrature);
}

TEST(RoughDiffuse, IsLambertianWhenSmooth) {
  const DirectionPair pair{direction(60.0_deg, 0.0_deg), direction(40.0_deg, 130.0_deg)};
  const Rgb albedo(0.9, 0.5, 0.1);
  EXPECT_LT(relative_difference(RoughDiffuse(albedo, 0.0).evaluate(pair),
                                Lambertian(albedo).evaluate(pair)),
            kRounding);
}

TEST(RoughDiffuse, LooksBrighterFromTheSideOfTheLight) {
  const RoughDiffuse rough(Rgb::Constant(0.8), 0.8);
  const Eigen::Vector3d wi = direction(60.0_deg, 0.0_deg);
  const Rgb back = rough.evaluate(DirectionPair{wi, direction(50.0_deg, 0.0_deg)});
  const Rgb forward = rough.evaluate(DirectionPair{wi, direction(50.0_deg, 180.0_deg)});
  EXPECT_GT(back[0], 1.5 * forward[0]);
}

TEST(VolumeScatter, SendsLightOnwardsWhenItsAsymmetryIsPositive) {
  const VolumeScatter onwards(Rgb::Constant(0.8), 0.5);
  const Eigen::Vector3d wi = direction(70.0_deg, 0.0_deg);
  const double forward = onwards.evaluate(DirectionPair{wi, direction(70.0_deg, 180.0_deg)})[0];
  const double back = onwards.evaluate(DirectionPair{wi, direction(70.0_deg, 0.0_deg)})[0];
  EXPECT_GT(forward, 2.0 * back);
}

TEST(Sheen, IsDarkFromAboveAndBrightAtTheRim) {
  const Sheen sheen(0.2, Rgb::Ones());
  const Eigen::Vector3d top = direction(5.0_deg, 0.0_deg);
  const Eigen::Vector3d rim = direction(80.0_deg, 0.0_deg);
  EXPECT_GT(sheen.evaluate(DirectionPair{rim, rim})[0],
            50.0 * sheen.evaluate(DirectionPair{top, top})[0]);
}

TEST(Backscatter, HalvesAtItsWidth) {
  const Backscatter glint(Rgb::Ones(), std::tan((10.0_deg).radians()));
  const Eigen::Vector3d wi = direction(30.0_deg, 0.0_deg);
  const double peak = glint.evaluate(DirectionPair{wi, wi})[0];
  const double aside = glint.evaluate(DirectionPair{wi, direction(50.0_deg, 0.0_deg)})[0];
  EXPECT_NEAR(aside / peak, 0.5, kRounding);  // phase 20 deg is theta_d = 10 deg
}

TEST(Ggx, ReflectsWhatFresnelSaysWhenAlmostSmooth) {
  const Rgb albedo = directional_albedo(Ggx(0.02, kGold), 40.0_deg);
  const Rgb expected = fresnel_reflectance(std::cos((40.0_deg).radians()), kGold);
  EXPECT_NEAR((albedo - expected).abs().maxCoeff(), 0.0, 0.01);  // the lobe's width is left over
}

TEST(Ggx, LosesOnlyMultipleReflectionsFromAPerfectMirror) {
  EXPECT_GT(directional_albedo(Ggx(0.1, kMirror), 0.0_deg)[0], 0.98);
  // alpha = 1 spreads facets evenly; seen straight on the lobe is 1 / (2 pi (1 + cos theta_o)) and
  // its albedo 1 - ln 2.
  EXPECT_NEAR(directional_albedo(Ggx(1.0, kMirror), 0.0_deg)[0], 0.306853, 2e-3);
}

TEST(Ggx, PeaksWhereTheHalfVectorIsTheNormal) {
  // D(0) = 1 / (pi alpha^2) and no shadowing at normal incidence: f = F / (4 pi alpha^2).
  const Eigen::Vector3d up(0.0, 0.0, 1.0);
  const double alpha = 0.1;
  const Rgb peak = Ggx(alpha, dielectric(1.5)).evaluate(DirectionPair{up, up});
  EXPECT_NEAR(peak[0], 0.04 / (4.0 * std::numbers::pi * 0.01), 1e-4);
}

TEST(AbcLobe, ReflectsWhatFresnelSaysWhenAlmostSmooth) {
  const AbcLobe lobe = AbcLobe::normalised(1e5, 2.5, kGold);
  const Rgb expected = fresnel_reflectance(std::cos((30.0_deg).radians()), kGold);
  EXPECT_NEAR((directional_albedo(lobe, 30.0_deg) - expected).abs().maxCoeff(), 0.0, 0.01);
}

TEST(AbcLobe, IsAFlatDistributionForVanishingSlope) {
  // D = A at B -> 0; f = F A / pi / (cos cos) while v-groove shadowing is idle.
  const AbcLobe lobe(Rgb::Constant(0.3), 1e-6, 1.0, dielectric(1.5));
  const Eigen::Vector3d up(0.0, 0.0, 1.0);
  EXPECT_NEAR(lobe.evaluate(DirectionPair{up, up})[0], 0.04 * 0.3 / std::numbers::pi, 1e-7);
}

TEST(AbcLobe, ShadowsAsAVGrooveDoes) {
  // All but flat D, so that only G is left: 1 in the mirror direction at 70 deg, 2 cos^2 70 deg =
  // 0.233956 back towards the light.
  const AbcLobe lobe(Rgb::Constant(std::numbers::pi), 1e-6, 1.0, kMirror);
  const Eigen::Vector3d wi = direction(70.0_deg, 0.0_deg);
  const double cos_squared = wi.z() * wi.z();
  const double mirror = lobe.evaluate(DirectionPair{wi, direction(70.0_deg, 180.0_deg)})[0];
  const double back = lobe.evaluate(DirectionPair{wi, wi})[0];
  EXPECT_NEAR(mirror * cos_squared, 1.0, 2e-3);  // kMirror's loss
  EXPECT_NEAR(back * cos_squared, 0.233956, 1e-3);
}

TEST(AbcLobe, NormalisesTheFacetsProjectedArea) {
  // B = 2, C = 1: the integral of D cos theta_h is pi / 2 (3 ln 3 - 2) D(0), so D(0) = 0.491281 and
  // f = F D(0) / 4 straight on.
  const Eigen::Vector3d up(0.0, 0.0, 1.0);
  const AbcLobe lobe = AbcLobe::normalised(2.0, 1.0, dielectric(1.5));
  EXPECT_NEAR(lobe.evaluate(DirectionPair{up, up})[0], 0.04 * 0.491281 / 4.0, 1e-7);
}

TEST(ShiftedGamma, KeepsItsEnergyWhenNarrowAndUnshadowed) {
  ShiftedGamma::Parameters narrow = satin_lobe();
  narrow.alpha = Rgb::Constant(0.01);
  narrow.p = Rgb::Constant(0.5);
  narrow.lambda = Rgb::Zero();
  narrow.f0 = Rgb::Constant(0.5);
  narrow.f1 = Rgb::Zero();
  narrow.rho = Rgb::Constant(std::numbers::pi / 4.0);  // the source divides by pi, not by 4
  EXPECT_NEAR(directional_albedo(ShiftedGamma(narrow), 0.0_deg)[0], 0.5, 0.01);
}

TEST(CoatedDiffuse, GivesBackAllThatEntersAPerfectlyWhiteBase) {
  const CoatedDiffuse white({1.5}, Rgb::Ones());
  for (const double theta_i : {0.0, 45.0, 75.0}) {
    const Angle angle = Angle::from_degrees(theta_i);
    const double entered = 1.0 - fresnel_reflectance(cos(angle), 1.5, 0.0);
    EXPECT_NEAR(directional_albedo(white, angle)[0], entered, kQuadrature) << theta_i;
  }
}

TEST(CoatedDiffuse, SaturatesColourByInternalReflection) {
  const Rgb bare(0.8, 0.4, 0.1);
  const Rgb coated = directional_albedo(CoatedDiffuse({1.5}, bare), 0.0_deg);
  EXPECT_LT(coated[1] / coated[0], bare[1] / bare[0]);
  EXPECT_LT(coated[2] / coated[1], bare[2] / bare[1]);
}

TEST(CoatedMetal, IsBareMetalUnderACoatOfAir) {
  const CoatedMetal coated({1.0}, 0.3, kGold);
  const Ggx bare(0.3, kGold);
  std::mt19937_64 random(6);
  for (int i = 0; i < 200; ++i) {
    const DirectionPair pair = random_pair(random);
    if (std::min(pair.wi.z(), pair.wo.z()) < 0.1) continue;  // air's curve is steep at grazing
    ASSERT_LT(relative_difference(coated.evaluate(pair), bare.evaluate(pair)), 1e-5);
  }
}

TEST(CoatedMetal, AbsorbsOnBothWays) {
  const Eigen::Vector3d up(0.0, 0.0, 1.0);
  const DirectionPair straight{up, up};
  const Rgb clear = CoatedMetal({1.5}, 0.2, kGold).evaluate(straight);
  const Rgb tinted = CoatedMetal({1.5, {0.0, 0.5, 1.0}}, 0.2, kGold).evaluate(straight);
  EXPECT_NEAR(tinted[0] / clear[0], 1.0, kCurveError);
  EXPECT_NEAR(tinted[1] / clear[1], 0.367879, kCurveError);  // e^-1
  EXPECT_NEAR(tinted[2] / clear[2], 0.135335, kCurveError);  // e^-2
}

TEST(CoatedMetal, AbsorbsMoreOnASlantPath) {
  // 60 deg outside is asin(sin 60 deg / 1.5) inside: 1 / cos = 1.224745 coat thicknesses each way.
  const DirectionPair mirror{direction(60.0_deg, 0.0_deg), direction(60.0_deg, 180.0_deg)};
  const Rgb clear = CoatedMetal({1.5}, 0.2, kGold).evaluate(mirror);
  const Rgb tinted = CoatedMetal({1.5, Rgb::Constant(0.5)}, 0.2, kGold).evaluate(mirror);
  EXPECT_NEAR(tinted[0] / clear[0], std::exp(-1.224745), kCurveError);
}

TEST(CoatedMetal, ReflectsWhatPassesTheCoatTwice) {
  // Narrow lobe, 60 deg outside, asin(sin 60 / 1.5) = 35.264 deg inside.
  const double outer = 1.0 - fresnel_reflectance(0.5, 1.5, 0.0);
  const RefractiveIndex inside{kGold.n / 1.5, kGold.k / 1.5};
  const Rgb expected = outer * outer * fresnel_reflectance(0.8164966, inside);
  // A wider lobe's tail is lost to total reflection.
  const Rgb albedo = directional_albedo(CoatedMetal({1.5}, 0.005, kGold), 60.0_deg);
  EXPECT_NEAR((albedo - expected).abs().maxCoeff(), 0.0, 0.01);
}

TEST(Mixture, AddsItsPartsByWeight) {
  const auto white = std::make_shared<Lambertian>(Rgb::Ones());
  const auto red = std::make_shared<Lambertian>(Rgb(1.0, 0.0, 0.0));
  const Mixture mixture({{Rgb(0.1, 0.2, 0.3), white}, {Rgb::Constant(0.5), red}});
  const Eigen::Vector3d up(0.0, 0.0, 1.0);
  const Rgb value = std::numbers::pi * mixture.evaluate(DirectionPair{up, up});
  EXPECT_NEAR((value - Rgb(0.6, 0.2, 0.3)).abs().maxCoeff(), 0.0, kRounding);
}

TEST(NonBilateral, ChangesInAMirrorButNotUnderExchange) {
  const NonBilateral model;
  const Eigen::Vector3d wi = direction(50.0_deg, 0.0_deg);
  const DirectionPair pair{wi, direction(70.0_deg, 60.0_deg)};
  const DirectionPair mirrored{wi, direction(70.0_deg, -60.0_deg)};
  const Rgb value = model.evaluate(pair);
  EXPECT_LT(relative_difference(value, model.evaluate(DirectionPair{pair.wo, pair.wi})), kRounding);
  EXPECT_GT((value - model.evaluate(mirrored)).abs().minCoeff(), 0.01);
}

TEST(NonBilateral, IsReciprocalPositiveAndBounded) {
  const NonBilateral model;
  std::mt19937_64 random(7);
  for (int i = 0; i < 1000; ++i) {
    const DirectionPair pair = random_pair(random);
    const Rgb value = model.evaluate(pair);
    ASSERT_LT(relative_difference(value, model.evaluate(DirectionPair{pair.wo, pair.wi})),
              kManySums);
    ASSERT_GT(value.minCoeff(), 0.0);
    ASSERT_LT(value.maxCoeff(), 1.0 / std::numbers::pi);
  }
}

TEST(AnalyticModels, RefuseParametersOutOfRange) {
  const std::function<void()> slips[] = {
      [] { Lambertian(Rgb(0.5, 1.1, 0.5)); },
      [] { RoughDiffuse(Rgb::Constant(0.5), -0.1); },
      [] { VolumeScatter(Rgb::Constant(0.5), 1.0); },
      [] { Sheen(0.0, Rgb::Ones()); },
      [] { Backscatter(Rgb::Constant(0.5), 0.0); },
      [] { Ggx(0.0, dielectric(1.5)); },
      [] { Ggx(1.5, dielectric(1.5)); },
      [] {
        Ggx(0.1, {Rgb::Constant(1.5), Rgb::Constant(-1.0)});
      },
      [] { Ggx(0.1, dielectric(std::nan(""))); },
      [] { AbcLobe(Rgb::Constant(-1.0), 1.0, 1.0, dielectric(1.5)); },
      [] { CoatedDiffuse({0.9}, Rgb::Constant(0.5)); },
      [] {
        CoatedDiffuse({1.5, Rgb::Constant(-1.0)}, Rgb::Constant(0.5));
      },
      [] { CoatedMetal({1.5}, 0.1, dielectric(1.5), Rgb::Constant(1.5)); },
      [] { Ggx(0.1, [](double) -> Rgb { return Rgb::Constant(1.2); }); },
      [] { CoatedMetal({1.5}, 0.1, [](double) -> Rgb { return Rgb::Constant(-0.2); }); },
      [] {
        Mixture({{Rgb::Ones(), nullptr}});
      },
      [] {
        Mixture({{Rgb::Constant(-0.1), std::make_shared<Lambertian>(Rgb::Ones())}});
      },
  };
  int number = 0;
  for (const auto& slip : slips) EXPECT_THROW(slip(), std::invalid_argument) << number++;
}

TEST(AnalyticModels, SayWhichParameterIsOutOfRange) {
  EXPECT_THAT([] { Ggx(1.5, dielectric(1.5)); },
              ::testing::ThrowsMessage<std::invalid_argument>(
                  ::testing::AllOf(::testing::HasSubstr("alpha"), ::testing::HasSubstr("1.5"))));
}

}  // namespace
}  // namespace gonio::brdf
