#include "gonio/brdf/fresnel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "gonio/brdf/rgb_curve.h"
#include "reference_values.h"

namespace gonio::brdf {
namespace {

using testing::kCurveError;
using testing::kGold;
using testing::kRounding;
using testing::kSilver;

/// Aluminium, tungsten and chromium, a channel each: every shape a metal's curve has.
const RefractiveIndex kThreeMetals{{1.430, 3.618, 3.145}, {7.507, 2.911, 3.312}};

TEST(Fresnel, IsFourPercentForGlassAtNormalIncidence) {
  EXPECT_NEAR(fresnel_reflectance(1.0, 1.5, 0.0), 0.04, kRounding);
}

TEST(Fresnel, IsOneAtGrazingIncidence) {
  EXPECT_NEAR(fresnel_reflectance(0.0, 1.5, 0.0), 1.0, kRounding);
  EXPECT_NEAR(fresnel_reflectance(0.0, 2.0, 3.0), 1.0, kRounding);
}

TEST(Fresnel, LosesThePolarisedHalfAtBrewstersAngle) {
  // At tan theta = n the other half reflects ((n^2 - 1) / (n^2 + 1))^2: 0.14793 for n = 1.5.
  EXPECT_NEAR(fresnel_reflectance(std::cos(std::atan(1.5)), 1.5, 0.0), 0.5 * 0.1479290, 1e-7);
}

TEST(Fresnel, ReflectsTotallyBeyondTheCriticalAngle) {
  const double critical_cosine = std::sqrt(1.0 - 1.0 / (1.5 * 1.5));
  EXPECT_NEAR(fresnel_reflectance(critical_cosine - 0.01, 1.0 / 1.5, 0.0), 1.0, kRounding);
  EXPECT_LT(fresnel_reflectance(critical_cosine + 0.01, 1.0 / 1.5, 0.0), 0.9);
}

TEST(Fresnel, GivesAluminiumItsPublishedReflectance) {
  // Rakic 1995 tabulates n = 1.366, k = 7.405 at 620 nm; normal reflectance 90.9 % (Rakic 1998).
  EXPECT_NEAR(fresnel_reflectance(1.0, 1.366, 7.405), 0.909, 0.001);
}

TEST(Fresnel, ReflectsNinePercentOfDiffuseLightFromGlass) {
  // 0.0918 for n = 1.5: Duntley, J. Opt. Soc. Am. 32 (1942); Orchard, ibid. 59 (1969).
  EXPECT_NEAR(diffuse_fresnel_reflectance(1.5), 0.0918, 5e-5);
}

TEST(Film, IsTheBareSubstrateWhenItIsGone) {
  for (const double cosine : {0.05, 0.4, 1.0}) {
    const Rgb bare = fresnel_reflectance(cosine, kGold);
    const Rgb none = film_reflectance(cosine, 1.0, {Rgb::Constant(2.4), 0.0}, kGold);
    const Rgb same = film_reflectance(cosine, 1.0, {Rgb::Constant(1.0), 300.0}, kGold);
    EXPECT_NEAR((none - bare).abs().maxCoeff(), 0.0, kRounding);
    EXPECT_NEAR((same - bare).abs().maxCoeff(), 0.0, kRounding);
  }
}

TEST(Film, CancelsAQuarterWaveAtTheGeometricMeanIndex) {
  const double quarter_nm = 532.0 / 4.0 / std::sqrt(1.5);
  const Film film{Rgb::Constant(std::sqrt(1.5)), quarter_nm};
  const Rgb reflected = film_reflectance(1.0, 1.0, film, dielectric(1.5));
  EXPECT_NEAR(reflected[1], 0.0, kRounding);
  EXPECT_GT(reflected[0], 1e-4);  // not a quarter wave of red
  EXPECT_GT(reflected[2], 1e-4);
}

TEST(Film, OfTitaniaReflectsAThirdFromGlass) {
  // A quarter wave of n = 2.4 on n = 1.5 reflects ((1.5 - 5.76) / (1.5 + 5.76))^2 = 34.4 %.
  const Film film{Rgb::Constant(2.4), 532.0 / 4.0 / 2.4};
  EXPECT_NEAR(film_reflectance(1.0, 1.0, film, dielectric(1.5))[1], 0.3443, 1e-4);
}

TEST(Film, ReflectsNoMoreThanItReceivesAtAnyAngle) {
  for (int i = 0; i <= 100; ++i) {
    const Rgb r = film_reflectance(i / 100.0, 1.55, {Rgb::Constant(2.6), 140.0}, kSilver);
    ASSERT_GE(r.minCoeff(), 0.0);
    ASSERT_LE(r.maxCoeff(), 1.0 + kRounding);
  }
}

TEST(RgbCurve, FollowsAnInterferenceFilm) {
  const auto film = [](double c) -> Rgb {
    return film_reflectance(c, 1.55, {Rgb::Constant(2.6), 140.0}, dielectric(1.59));
  };
  const RgbCurve curve(film);
  for (int i = 0; i <= 5000; ++i) {
    ASSERT_LT((curve(i / 5000.0) - film(i / 5000.0)).abs().maxCoeff(), 10.0 * kCurveError);
  }
}

TEST(RgbCurve, FollowsFresnelReflectionOfMetalsAndGlass) {
  for (const RefractiveIndex& index :
       {kGold, kSilver, kThreeMetals, dielectric(1.3), dielectric(1.8), dielectric(2.2)}) {
    const RgbCurve curve([&](double c) -> Rgb { return fresnel_reflectance(c, index); });
    double worst = 0.0;
    for (int i = 0; i <= 20000; ++i) {
      const double cosine = i / 20000.0;
      worst =
          std::max(worst, (curve(cosine) - fresnel_reflectance(cosine, index)).abs().maxCoeff());
    }
    EXPECT_LT(worst, kCurveError);
  }
}

TEST(RgbCurve, IsExactForCubicsAndClampsItsArgument) {
  const RgbCurve curve([](double x) { return Rgb(x, x * x, x * x * x); });
  EXPECT_NEAR((curve(0.3) - Rgb(0.3, 0.09, 0.027)).abs().maxCoeff(), 0.0, kRounding);
  EXPECT_NEAR((curve(1.5) - Rgb::Ones()).abs().maxCoeff(), 0.0, kRounding);
  EXPECT_NEAR(curve(-1.0).abs().maxCoeff(), 0.0, kRounding);
}

}  // namespace
}  // namespace gonio::brdf
