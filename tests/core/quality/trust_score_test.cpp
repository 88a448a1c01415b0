#include "gonio/quality/trust_score.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "gonio/basis/dense_field.h"

namespace gonio::quality {
namespace {

constexpr double kSigma = 0.1;

/// A truth of 0.2 per sr, and a fit that is off by half a sigma in R, by one and a half in G, by
/// three in B.
struct KnownSigmas {
  KnownSigmas() : truth(brdf::IndexConvention::bin_centre, brdf::RadiometricScale::si) {
    for (const std::uint32_t cell : brdf::lattice::cells_above_horizon()) {
      truth.set_value(cell, brdf::Rgb::Constant(0.2));
    }
    basis.mean = basis::mapped_values(basis.mapping, truth).col(0);
    basis.components.setOnes(basis.mean.size(), 1);
    fit.coefficients = Eigen::RowVector3d(0.5, -1.5, 3.0) * kSigma;
    bands.sigma.setConstant(basis.mean.size(), 3, static_cast<float>(kSigma));
    bands.factor_68 = 1.0;
    bands.factor_95 = 2.0;
  }

  brdf::BrdfTable truth;
  basis::Basis basis;
  basis::Fit fit;
  basis::Uncertainty bands;
};

TEST(Coverage, IsTheShareInsideTheLimitsOverCellsAndChannels) {
  const KnownSigmas known;
  const Coverage inside = coverage(known.truth, known.basis, known.fit, known.bands);
  EXPECT_NEAR(inside.in_68, 1.0 / 3.0, 1e-9);
  EXPECT_NEAR(inside.in_95, 2.0 / 3.0, 1e-9);
}

TEST(Coverage, FollowsTheFactorsAndEachCellsOwnSigma) {
  KnownSigmas known;
  known.bands.factor_95 = 3.1;
  EXPECT_NEAR(coverage(known.truth, known.basis, known.fit, known.bands).in_95, 1.0, 1e-9);
  known.bands.sigma.col(0) *= 0.1F;  // now five sigmas off
  const Coverage inside = coverage(known.truth, known.basis, known.fit, known.bands);
  EXPECT_NEAR(inside.in_68, 0.0, 1e-9);
  EXPECT_NEAR(inside.in_95, 2.0 / 3.0, 1e-9);
}

TEST(Coverage, LeavesOutWhatTheTruthDoesNotKnowAndWeighsGrazingCellsLess) {
  KnownSigmas known;
  const std::vector<std::uint32_t>& cells = brdf::lattice::cells_above_horizon();
  Eigen::Index grazing = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const brdf::lattice::Index at = brdf::lattice::index_from_cell(cells[i]);
    if (at.theta_d < 60) continue;
    known.bands.sigma.row(static_cast<Eigen::Index>(i)).setConstant(1e-4F);  // nothing is inside
    ++grazing;
  }
  const double left = 1.0 - static_cast<double>(grazing) / static_cast<double>(cells.size());
  const Coverage inside = coverage(known.truth, known.basis, known.fit, known.bands);
  EXPECT_GT(inside.in_95, 2.0 / 3.0 * left * 1.02) << "as if every cell weighed the same";
  EXPECT_LT(inside.in_95, 2.0 / 3.0);
  for (const std::uint32_t cell : cells) {
    if (brdf::lattice::index_from_cell(cell).theta_d >= 60) known.truth.set_invalid(cell);
  }
  EXPECT_NEAR(coverage(known.truth, known.basis, known.fit, known.bands).in_95, 2.0 / 3.0, 1e-9);
}

TEST(AreaUnderRoc, CountsPairsInTheRightOrder) {
  using Results = std::vector<std::pair<double, bool>>;  // score, failed
  EXPECT_DOUBLE_EQ(area_under_roc(Results{{1, true}, {3, false}, {2, true}, {4, false}}), 1.0);
  EXPECT_DOUBLE_EQ(area_under_roc(Results{{5, true}, {3, false}, {4, false}}), 0.0);
  // Of six pairs two are in order and one is a tie.
  EXPECT_DOUBLE_EQ(
      area_under_roc(Results{{2, true}, {4, true}, {1, false}, {2, false}, {5, false}}), 2.5 / 6.0);
  EXPECT_TRUE(std::isnan(area_under_roc(Results{{1, true}, {2, true}})));
  EXPECT_TRUE(std::isnan(area_under_roc(Results{})));
}

}  // namespace
}  // namespace gonio::quality
