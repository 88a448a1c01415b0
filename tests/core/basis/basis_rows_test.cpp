#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "directions_deg.h"
#include "gonio/basis/basis.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

namespace lattice = brdf::lattice;

Eigen::Index column_of(const lattice::Index& index) {
  const auto& cells = lattice::cells_above_horizon();
  const auto cell = static_cast<std::uint32_t>(lattice::cell_from_index(index));
  return std::lower_bound(cells.begin(), cells.end(), cell) - cells.begin();
}

/// Mapped red channel of a training material, reconstructed exactly: x = mean + q.c at any place.
struct Member {
  Eigen::VectorXd coefficients;
  test::Lobe model = test::material(3);

  Member() {
    const Basis& basis = test::full_basis();
    const Eigen::Index p = basis.mean.size();
    const auto row = test::training_set().row(3, 0);
    const Eigen::VectorXf residual = Eigen::Map<const Eigen::VectorXf>(row.data(), p) - basis.mean;
    coefficients = (basis.components.transpose() * residual).cast<double>();
    coefficients.array() /= basis.singular_values.head(basis.component_count()).array().square();
  }
  double truth(const brdf::HalfDiff& at) const {
    const LogMapping mapping;
    return mapping.forward(model.evaluate(brdf::shading_geometry(at))[0],
                           mapping.weight(brdf::polar_cosines(at.theta_h, at.theta_d, at.phi_d)));
  }
  double found(const brdf::HalfDiff& at) const {
    const BasisRow row = BasisRows(test::full_basis()).at(at);
    return row.mean + row.q.dot(coefficients);
  }
};

TEST(BasisRows, AreTheStoredOnesAtABinCentre) {
  const Basis& basis = test::full_basis();
  const BasisRow row = BasisRows(basis).at(test::bin_centre(20, 30, 40));
  const Eigen::Index column = column_of({20, 30, 40});
  EXPECT_LT((row.q - basis.components.row(column).transpose().cast<double>()).norm(), 1e-9);
  EXPECT_NEAR(row.mean, basis.mean[column], 1e-9);
}

TEST(BasisRows, AreHalfwayBetweenTwoBinCentres) {
  const Basis& basis = test::full_basis();
  brdf::HalfDiff between = test::bin_centre(20, 30, 40);
  between.theta_d += Angle::from_degrees(0.5);
  const BasisRow row = BasisRows(basis).at(between);
  const Eigen::RowVectorXf expected = (basis.components.row(column_of({20, 30, 40})) +
                                       basis.components.row(column_of({20, 31, 40}))) /
                                      2.0f;
  EXPECT_LT((row.q.transpose() - expected.cast<double>()).norm(), 1e-6);
}

TEST(BasisRows, FollowAMaterialBetweenCellsManyTimesCloserThanSnapping) {
  const Member member;
  double interpolated = 0.0;
  double snapped = 0.0;
  for (const double theta_h : {2.3, 5.9, 11.2, 23.7}) {
    const brdf::HalfDiff at = half_diff_deg(theta_h, 34.98, 61.0);
    const brdf::HalfDiff cell = lattice::angles_of(lattice::nearest_index(at));
    interpolated += std::abs(member.found(at) - member.truth(at));
    snapped += std::abs(member.found(cell) - member.truth(at));
  }
  EXPECT_LT(interpolated, 0.1 * snapped);
}

TEST(BasisRows, WrapAroundPhiDByReciprocity) {
  const BasisRows rows(test::full_basis());
  const BasisRow before = rows.at(half_diff_deg(10.0, 20.0, 179.99));
  const BasisRow after = rows.at(half_diff_deg(10.0, 20.0, 0.01 - 180.0));
  EXPECT_LT((before.q - after.q).norm(), 1e-3 * before.q.norm());
}

TEST(BasisRows, KnowTheWeightOfTheExactDirection) {
  const BasisRow row = BasisRows(test::full_basis()).at(half_diff_deg(0.0, 60.0, 0.0));
  EXPECT_NEAR(row.weight, 0.25, 1e-12);  // theta_i = theta_o = 60 deg
}

TEST(BasisRows, HaveAValueUpToTheHorizonAndNoneBelow) {
  const BasisRows rows(test::full_basis());
  // theta_i = 89.95 deg: every corner but the inner ones lies below the horizon.
  EXPECT_TRUE(rows.at(half_diff_deg(45.0, 44.95, 180.0)).q.allFinite());
  EXPECT_TRUE(rows.at(half_diff_deg(0.0, 89.99, 90.0)).q.allFinite());
  EXPECT_THROW(rows.at(half_diff_deg(45.0, 45.1, 180.0)), std::invalid_argument);
  EXPECT_THROW(rows.at(half_diff_deg(2.84, 89.0, 15.0)), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::basis
