#include "gonio/basis/dense_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "gonio/parallel/parallel.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

/// Coefficients as the prior draws them, fixed.
Eigen::MatrixXd some_coefficients(Eigen::Index k) {
  Eigen::MatrixXd c(k, 3);
  for (Eigen::Index i = 0; i < c.size(); ++i) {
    c.data()[i] = 0.2 * std::sin(1.7 * static_cast<double>(i) + 0.3);
  }
  return c;
}

/// k products of size 1 in float32, compared with the same in double.
constexpr double kFieldTolerance = 1e-4;

TEST(DenseField, IsMeanPlusComponentsTimesCoefficients) {
  const Basis& basis = test::full_basis();
  const Eigen::MatrixXd c = some_coefficients(basis.component_count());
  const Eigen::MatrixXf field = mapped_field(basis, c);
  ASSERT_EQ(field.cols(), 3);
  for (Eigen::Index i = 0; i < field.rows(); i += 1009) {
    const Eigen::RowVectorXd expected = basis.components.row(i).cast<double>() * c;
    for (Eigen::Index channel = 0; channel < 3; ++channel) {
      ASSERT_NEAR(field(i, channel), static_cast<double>(basis.mean[i]) + expected[channel],
                  kFieldTolerance);
    }
  }
}

TEST(DenseField, OfFewerCoefficientsUsesTheFirstComponents) {
  const Basis& basis = test::full_basis();
  Eigen::MatrixXd c = some_coefficients(basis.component_count());
  c.bottomRows(c.rows() - 3).setZero();
  EXPECT_EQ(mapped_field(basis, c), mapped_field(basis, c.topRows(3)));
}

TEST(DenseField, ExpandsToTheInverseMappingOfTheField) {
  const Basis& basis = test::full_basis();
  const Eigen::MatrixXd c = some_coefficients(basis.component_count());
  const Eigen::MatrixXf field = mapped_field(basis, c);
  const brdf::BrdfTable table = expand(basis, c);
  const auto& cells = brdf::lattice::cells_above_horizon();
  std::size_t valid = 0;
  for (std::size_t cell = 0; cell < brdf::lattice::kCells; ++cell) valid += table.valid(cell);
  EXPECT_EQ(valid, cells.size());
  for (std::size_t i = 0; i < cells.size(); i += 991) {
    const brdf::HalfDiff at = brdf::lattice::angles_of(brdf::lattice::index_from_cell(cells[i]));
    const double w = basis.mapping.weight(brdf::polar_cosines(at.theta_h, at.theta_d, at.phi_d));
    const brdf::Rgb f = table.value(cells[i]);
    for (int channel = 0; channel < 3; ++channel) {
      const double expected = basis.mapping.inverse(
          static_cast<double>(field(static_cast<Eigen::Index>(i), channel)), w);
      // exp in float32, then the difference to epsilon
      ASSERT_NEAR(f[channel], expected, 1e-6 * (expected + basis.mapping.epsilon / w));
    }
  }
}

TEST(DenseField, ExpandsExtremeCoefficientsToFiniteNonNegativeValues) {
  const Basis& basis = test::full_basis();
  const brdf::BrdfTable table = expand(basis, 1e4 * some_coefficients(basis.component_count()));
  for (const std::uint32_t cell : brdf::lattice::cells_above_horizon()) {
    const brdf::Rgb f = table.value(cell);
    ASSERT_TRUE(f.isFinite().all() && (f >= 0.0).all()) << "cell " << cell;
  }
}

TEST(DenseField, ProjectionFindsTheCoefficientsOfAFieldInTheSpan) {
  const Basis& basis = test::full_basis();
  const Eigen::MatrixXd c = some_coefficients(basis.component_count()).topRows(6);
  const Eigen::MatrixXd found = project(basis, mapped_field(basis, c));
  EXPECT_LT((found.topRows(6) - c).cwiseAbs().maxCoeff(), 1e-3);
}

TEST(DenseField, ProjectionIgnoresCellsWithoutAValue) {
  const Basis& basis = test::full_basis();
  Eigen::MatrixXf field = mapped_field(basis, some_coefficients(basis.component_count()));
  const Eigen::MatrixXd complete = project(basis, field);
  field(1234, 1) = std::numeric_limits<float>::quiet_NaN();
  const Eigen::MatrixXd found = project(basis, field);
  EXPECT_TRUE(found.allFinite());
  EXPECT_EQ(found.col(0), complete.col(0));
}

TEST(DenseField, GivesTheSameBytesWithOneAndTwoThreads) {
  const Basis& basis = test::full_basis();
  const Eigen::MatrixXd c = some_coefficients(basis.component_count());
  parallel::set_thread_count(1);
  const Eigen::MatrixXf one = mapped_field(basis, c);
  const Eigen::MatrixXd projected_by_one = project(basis, one);
  parallel::set_thread_count(2);
  EXPECT_EQ(one, mapped_field(basis, c));
  EXPECT_EQ(projected_by_one, project(basis, one));
  parallel::set_thread_count(0);
}

TEST(DenseField, RefusesOtherShapes) {
  const Basis& basis = test::full_basis();
  EXPECT_THROW(expand(basis, Eigen::MatrixXd::Zero(2, 2)), std::invalid_argument);
  EXPECT_THROW(expand(basis, Eigen::MatrixXd::Zero(basis.component_count() + 1, 3)),
               std::invalid_argument);
  EXPECT_THROW(project(basis, Eigen::MatrixXf::Zero(5, 3)), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::basis
