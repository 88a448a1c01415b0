#include "gonio/quality/physics_checks.h"
#include "directions_deg.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

namespace gonio::quality {
namespace {

using brdf::RadiometricScale;
using brdf::Rgb;

constexpr double kQuadrature = 5e-3;

class Lambertian final : public brdf::BrdfModel {
 public:
  explicit Lambertian(const Rgb& albedo) : per_sr_(albedo / std::numbers::pi) {}

 private:
  Rgb evaluate_visible(const brdf::ShadingGeometry&) const override { return per_sr_; }
  Rgb per_sr_;
};

/// A cap around the mirror direction: constant for theta_h below `edge`. At normal incidence wo has
/// polar angle 2 theta_h, so its albedo is f pi sin^2(2 edge).
class Cap final : public brdf::BrdfModel {
 public:
  Cap(double per_sr, Angle edge) : per_sr_(per_sr), edge_(edge) {}

 private:
  Rgb evaluate_visible(const brdf::ShadingGeometry& g) const override {
    return Rgb::Constant(g.half_diff.theta_h < edge_ ? per_sr_ : 0.0);
  }
  double per_sr_;
  Angle edge_;
};

samples::Sample sample(double theta_h, double theta_d, double phi_d, double value, int pose = -1) {
  samples::Sample s;
  s.direction = half_diff_deg(theta_h, theta_d, phi_d);
  s.value_per_sr = Rgb::Constant(value);
  s.sigma_per_sr = Rgb::Constant(0.006);
  s.u_common_per_sr = Rgb::Constant(0.008);  // together 0.010
  s.pose = pose;
  return s;
}

TEST(DirectionalAlbedo, OfALambertianIsItsReflectanceAtEveryAngle) {
  const Lambertian model({0.9, 0.5, 0.1});
  for (const double degrees : {0.0, 40.0, 80.0}) {
    const Rgb albedo = directional_albedo(model, Angle::from_degrees(degrees));
    EXPECT_NEAR(albedo[0], 0.9, 0.9 * kQuadrature) << degrees;
    EXPECT_NEAR(albedo[2], 0.1, 0.1 * kQuadrature) << degrees;
  }
  EXPECT_THROW(directional_albedo(model, Angle::from_degrees(90.0)), std::invalid_argument);
  EXPECT_THROW(directional_albedo(model, Angle::from_degrees(-1.0)), std::invalid_argument);
}

TEST(DirectionalAlbedo, OfANarrowCapIsItsSolidAngleTimesCosine) {
  constexpr double kEdgeOnTheGrid = 0.02;  // the cap's edge falls between two of its steps
  const Cap cap(10.0, Angle::from_degrees(4.0));
  const double expected =
      10.0 * std::numbers::pi * std::pow(std::sin(8.0 * std::numbers::pi / 180.0), 2);
  EXPECT_NEAR(directional_albedo(cap, Angle())[0], expected, kEdgeOnTheGrid * expected);
}

TEST(Energy, FailsOnlyWhenMoreLightLeavesThanArrives) {
  EXPECT_TRUE(check_energy(Lambertian({1.0, 0.5, 0.2}), RadiometricScale::si).passed);
  const EnergyCheck too_bright = check_energy(Lambertian({0.2, 1.1, 0.2}), RadiometricScale::si);
  EXPECT_FALSE(too_bright.passed);
  EXPECT_NEAR(too_bright.largest, 1.1, 1.1 * kQuadrature);
  EXPECT_EQ(too_bright.albedos.size(), 6u);
}

TEST(Energy, HasNothingToSayOnMerlsScale) {
  const EnergyCheck check = check_energy(Lambertian({3.0, 3.0, 3.0}), RadiometricScale::merl);
  EXPECT_FALSE(check.applicable);
  EXPECT_TRUE(check.passed);
  EXPECT_TRUE(check.albedos.empty());
}

TEST(Reciprocity, FindsExchangedDirectionsAndScoresThem) {
  samples::SampleSet set;
  set.samples = {sample(20, 40, 70, 0.30, 0), sample(5, 30, 10, 0.50, 1),
                 sample(20, 40, 250, 0.32, 2)};  // the first with light and detector exchanged
  const ReciprocityCheck check = check_reciprocity(set);
  ASSERT_EQ(check.pairs.size(), 1u);
  EXPECT_EQ(check.pairs[0].first, 0u);
  EXPECT_EQ(check.pairs[0].second, 2u);
  EXPECT_NEAR(check.pairs[0].ratio[1], 0.9375, 1e-12);
  EXPECT_NEAR(check.pairs[0].z[1], -0.02 / (0.01 * std::sqrt(2.0)), 1e-9);
  EXPECT_NEAR(check.largest_z, std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(check.rms_z, std::sqrt(2.0), 1e-9);
  EXPECT_NEAR(check.mean_log_ratio, std::log(0.9375), 1e-12);
  EXPECT_TRUE(check.passed);
  EXPECT_FALSE(check_reciprocity(set, Angle::from_degrees(0.25), 1.0).passed);
}

TEST(Reciprocity, DoesNotTakeARepeatOrANeighbourForAnExchange) {
  samples::SampleSet set;
  set.samples = {sample(20, 40, 70, 0.3), sample(20, 40, 70, 0.3), sample(20, 40, 110, 0.3),
                 sample(20, 41, 250, 0.3), sample(21, 40, 250, 0.3)};
  const ReciprocityCheck check = check_reciprocity(set);
  EXPECT_TRUE(check.pairs.empty());
  EXPECT_TRUE(check.passed);
  EXPECT_TRUE(std::isnan(check.rms_z));
}

TEST(Reciprocity, PairsTheNearestFirstAndEachOnce) {
  samples::SampleSet set;
  set.samples = {sample(20, 40, 70, 0.3, 0), sample(20.1, 40, 250, 0.3, 1),
                 sample(20.02, 40, 250, 0.3, 2)};
  const ReciprocityCheck check = check_reciprocity(set);
  ASSERT_EQ(check.pairs.size(), 1u);
  EXPECT_EQ(check.pairs[0].second, 2u);
}

/// One tenth of a neper per tenth of a degree, two degrees from the mirror direction.
class NarrowLobe final : public brdf::BrdfModel {
  Rgb evaluate_visible(const brdf::ShadingGeometry& g) const override {
    const double degrees = g.half_diff.theta_h.degrees();
    return Rgb::Constant(20.0 * std::exp(-0.25 * degrees * degrees));
  }
};

TEST(Reciprocity, CountsWhatAngleErrorsMakeOfANarrowLobe) {
  const NarrowLobe lobe;
  const auto at = [&](double theta_h, double phi_d, double seen_at, int pose) {
    const brdf::HalfDiff there = half_diff_deg(seen_at, 40, phi_d);
    const double value = lobe.evaluate(brdf::shading_geometry(there))[0];
    samples::Sample s = sample(theta_h, 40, phi_d, value, pose);
    s.sigma_per_sr = Rgb::Constant(0.01 * value);
    s.u_common_per_sr.setZero();
    return s;
  };
  const Angle tolerance = Angle::from_degrees(0.25);
  samples::SampleSet apart;  // where they say they are, 0.2 deg from each other
  apart.samples = {at(2.0, 70, 2.0, 0), at(2.2, 250, 2.2, 1)};
  EXPECT_GT(check_reciprocity(apart).rms_z, 5.0);
  EXPECT_NEAR(check_reciprocity(apart, tolerance, 3.0, &lobe).rms_z, 1.0, 0.1);

  samples::SampleSet off;  // 0.2 deg from where they say they are
  off.samples = {at(2.0, 70, 2.0, 0), at(2.0, 250, 2.2, 1)};
  EXPECT_GT(check_reciprocity(off, tolerance, 3.0, &lobe).rms_z, 5.0) << "nothing was stated";
  for (samples::Sample& s : off.samples) s.u_theta_h = Angle::from_degrees(0.15);
  // 0.2 deg of difference over sqrt(2) 0.15 deg, along a slope that is not constant.
  EXPECT_NEAR(check_reciprocity(off, tolerance, 3.0, &lobe).rms_z, 0.2 / 0.212, 0.1);

  // The same of a tilt: two degrees from the mirror direction it moves theta_h by one of its parts.
  for (samples::Sample& s : off.samples) {
    s.u_theta_h = Angle();
    s.u_tilt = Angle::from_degrees(0.15);
  }
  EXPECT_NEAR(check_reciprocity(off, tolerance, 3.0, &lobe).rms_z, 0.2 / 0.212, 0.1);

  samples::SampleSet wrong = off;  // a factor that no angle explains
  wrong.samples[1].value_per_sr *= 0.3;
  EXPECT_FALSE(check_reciprocity(wrong, tolerance, 3.0, &lobe).passed);
}

TEST(Reciprocity, LeavesSubSamplesOfOnePoseAlone) {
  samples::SampleSet set;  // near normal incidence a patch holds its own exchanged directions
  set.samples = {sample(20, 0.05, 0, 0.3, 4), sample(20, 0.05, 180, 0.3, 4)};
  EXPECT_TRUE(check_reciprocity(set).pairs.empty());
}

TEST(ClampedCells, AreTheZeroOnesAboveTheHorizon) {
  brdf::BrdfTable table(brdf::IndexConvention::bin_centre, RadiometricScale::si);
  const auto& cells = brdf::lattice::cells_above_horizon();
  for (const std::uint32_t cell : cells) table.set_value(cell, Rgb::Constant(0.2));
  table.set_value(cells[5], Rgb(0.1, 0.0, 0.1));
  table.set_value(cells[900'000], Rgb::Constant(-0.5));  // clamped when stored
  table.set_invalid(cells[77]);
  EXPECT_EQ(clamped_cells(table), 2u);
}

}  // namespace
}  // namespace gonio::quality
