// What is known about directions over the whole lattice: where they leave most open, and how well
// an instrument measures each.
#include "gonio/design/coverage.h"

#include <gtest/gtest.h>

#include <cmath>

#include "gonio/design/candidates.h"
#include "gonio/design/expected_noise.h"
#include "gonio/design/importance.h"

namespace gonio::design {
namespace {

constexpr double kLatticeSum = 1e-3;  // single-precision sums over a lattice

/// One component that is 1 in a box of the lattice, one that is 1 in another.
basis::Basis two_boxes() {
  basis::Basis basis;
  basis.materials = {{"a", "", ""}, {"b", "", ""}};
  const auto p = static_cast<Eigen::Index>(basis_cell_count());
  basis.mean = Eigen::VectorXf::Zero(p);
  basis.components.setZero(p, 2);
  for (Eigen::Index i = 0; i < p; ++i) {
    const brdf::HalfDiff at = direction_of_basis_cell(static_cast<std::uint32_t>(i));
    if (at.theta_d > Angle::from_degrees(45.0) || at.phi_d > Angle::from_degrees(30.0)) continue;
    if (at.theta_h < Angle::from_degrees(2.5) && at.theta_d < Angle::from_degrees(15.0)) {
      basis.components(i, 0) = 1.0F;
    }
    if (at.theta_h > Angle::from_degrees(10.0) && at.theta_h < Angle::from_degrees(22.5) &&
        at.theta_d > Angle::from_degrees(30.0)) {
      basis.components(i, 1) = 1.0F;
    }
  }
  return basis;
}

TEST(LargestUncoveredRegion, IsWhereTheSamplesSayNothing) {
  const basis::Basis basis = two_boxes();
  const Eigen::VectorXf weights = importance_weights({1.0});
  Eigen::MatrixXd first_known(1, 2);
  first_known << 100.0, 0.0;
  const UncoveredRegion second = largest_uncovered_region(basis, first_known, weights, 1.0);
  EXPECT_DOUBLE_EQ(second.where.theta_h_from.degrees(), 10.0);
  EXPECT_DOUBLE_EQ(second.where.theta_h_to.degrees(), 22.5);
  EXPECT_DOUBLE_EQ(second.where.theta_d_from.degrees(), 30.0);
  EXPECT_DOUBLE_EQ(second.where.phi_d_from.degrees(), 0.0);
  EXPECT_DOUBLE_EQ(second.where.phi_d_to.degrees(), 30.0);
  EXPECT_NEAR(second.share, 1.0, kLatticeSum);
  // Nothing is known there: the prior's own spread, 1/sqrt(m).
  EXPECT_NEAR(second.rms, 1.0 / std::sqrt(6.0), kLatticeSum);
  Eigen::MatrixXd second_known(1, 2);
  second_known << 0.0, 100.0;
  const UncoveredRegion first = largest_uncovered_region(basis, second_known, weights, 1.0);
  EXPECT_DOUBLE_EQ(first.where.theta_h_to.degrees(), 2.5);
  EXPECT_DOUBLE_EQ(first.where.theta_d_to.degrees(), 15.0);
  EXPECT_THROW(largest_uncovered_region(basis, first_known, weights.head(7), 1.0),
               std::invalid_argument);
}

TEST(ExpectedNoise, IsTheRelativeNoiseWhereThereIsLight) {
  basis::Basis basis = two_boxes();
  basis.mean.setConstant(std::log(0.5F));  // w f = 0.499: the mapping is a plain logarithm
  const std::vector<float> noise = expected_noise(basis, {0.03, Angle()});
  EXPECT_NEAR(noise[1234] / (6.0 * 0.03 * 0.03), 0.998 * 0.998, kLatticeSum);
  basis.mean.setConstant(std::log(0.001F));  // black: w f = 0, and a share of nothing is nothing
  EXPECT_NEAR(static_cast<double>(expected_noise(basis, {0.03, Angle()})[1234]), 0.0, 1e-9);
}

TEST(ExpectedNoise, CountsDirectionErrorsWhereMaterialsAreSteep) {
  basis::Basis basis = two_boxes();
  // A mean that falls by 3 nepers per radian of theta_d.
  for (Eigen::Index i = 0; i < basis.mean.size(); ++i) {
    basis.mean[i] = static_cast<float>(
        -3.0 * direction_of_basis_cell(static_cast<std::uint32_t>(i)).theta_d.radians());
  }
  const Angle tilt = Angle::from_degrees(0.1);
  const std::vector<float> noise = expected_noise(basis, {0.0, tilt});
  const auto flat = basis_cell_of(
      {Angle::from_degrees(40.3), Angle::from_degrees(20.5), Angle::from_degrees(90.5), Angle()});
  const auto edge = basis_cell_of(
      {Angle::from_degrees(0.5), Angle::from_degrees(14.5), Angle::from_degrees(10.5), Angle()});
  const double slope_only = 6.0 * std::pow(3.0 * tilt.radians(), 2);
  EXPECT_NEAR(static_cast<double>(noise.at(flat.value())) / slope_only, 1.0, 1e-2);
  // Where a component steps materials differ from their mean, and so do their slopes.
  EXPECT_GT(static_cast<double>(noise.at(edge.value())), 2.0 * slope_only);
  EXPECT_THROW(expected_noise(basis, {2.0, Angle()}), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::design
