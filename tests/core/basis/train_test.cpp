#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

#include "gonio/basis/basis.h"
#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

/// Rows as doubles, mean subtracted: the definition, without blocks or float32.
Eigen::MatrixXd dense_centred_rows(const TrainingSet& set,
                                   const std::vector<std::size_t>& materials) {
  const Eigen::Index p = static_cast<Eigen::Index>(set.cells().size());
  Eigen::MatrixXd x(p, static_cast<Eigen::Index>(3 * materials.size()));
  for (std::size_t i = 0; i < materials.size(); ++i) {
    for (int channel = 0; channel < 3; ++channel) {
      const auto row = set.row(materials[i], channel);
      x.col(static_cast<Eigen::Index>(3 * i) + channel) =
          Eigen::Map<const Eigen::VectorXf>(row.data(), p).cast<double>();
    }
  }
  const Eigen::VectorXd mean = x.rowwise().mean();
  x.colwise() -= mean;
  return x;
}

using test::kGramTolerance;
constexpr double kSinglePrecision = 5e-8;

TEST(Gram, EqualsTheDenseDoubleComputation) {
  std::vector<std::size_t> all(test::kMaterials);
  std::iota(all.begin(), all.end(), std::size_t{0});
  const Eigen::MatrixXd x = dense_centred_rows(test::training_set(), all);
  const Eigen::MatrixXd expected = x.transpose() * x;
  const Eigen::MatrixXd& gram = test::training_gram();
  ASSERT_EQ(gram.rows(), 3 * test::kMaterials);
  EXPECT_LT((gram - expected).norm(), kGramTolerance * expected.norm());
  EXPECT_EQ(gram, Eigen::MatrixXd(gram.transpose()));
}

TEST(Train, OnASubsetEqualsTrainingOnThoseMaterialsAlone) {
  const std::vector<std::size_t> subset = {0, 2, 3, 5};
  const Basis part = train(test::training_set(), test::training_gram(), subset, 8);

  TrainingSet alone(brdf::RadiometricScale::si);
  for (const std::size_t i : subset) {
    alone.add({"lobe-" + std::to_string(i), "", ""}, test::material(static_cast<int>(i)));
  }
  const Basis direct = train(alone, centred_gram(alone), 8);

  ASSERT_EQ(part.component_count(), 8);
  EXPECT_EQ(part.materials[1].name, "lobe-2");
  EXPECT_EQ(part.row_count(), 12);
  EXPECT_LT((part.mean - direct.mean).cwiseAbs().maxCoeff(), 2e-6);
  const Eigen::ArrayXd squares = direct.singular_values.array().square();
  EXPECT_LT((part.singular_values.array().square() - squares).abs().maxCoeff(),
            kGramTolerance * squares[0]);
  for (Eigen::Index j = 0; j < 5; ++j) {  // beyond, components are close to each other in size
    EXPECT_LT((part.components.col(j) - direct.components.col(j)).norm(),
              1e-3 * static_cast<float>(direct.singular_values[j]))
        << "component " << j;
  }
}

TEST(Train, GivesOrthogonalColumnsWithTheSingularValuesAsLengths) {
  const Basis& basis = test::full_basis();
  const Eigen::MatrixXd q = basis.components.cast<double>();
  const Eigen::MatrixXd product = q.transpose() * q;
  const Eigen::VectorXd squares =
      basis.singular_values.head(basis.component_count()).array().square();
  EXPECT_LT((product - Eigen::MatrixXd(squares.asDiagonal())).norm(), 1e-6 * squares[0]);
}

TEST(Train, ReproducesItsMaterialsWithAllComponents) {
  const std::vector<std::size_t> materials = {0, 1, 2};
  const Basis basis = train(test::training_set(), test::training_gram(), materials, 100);
  const Eigen::MatrixXd x = dense_centred_rows(test::training_set(), materials);
  const Eigen::MatrixXd q = basis.components.cast<double>();
  const Eigen::VectorXd squares =
      basis.singular_values.head(basis.component_count()).array().square();
  const Eigen::MatrixXd& u = basis.left_vectors;
  ASSERT_EQ(u.rows(), 9);
  ASSERT_EQ(u.cols(), basis.component_count());
  EXPECT_LT((q * u.transpose() - x).norm(), 1e-3 * x.norm());
  const Eigen::MatrixXd projected = squares.asDiagonal().inverse() * (q.transpose() * x);
  for (Eigen::Index j = 0; j < u.cols(); ++j) {
    // Into the projection on a weak component the strongest leaks, squared, by its rounding.
    const double tolerance = kSinglePrecision * squares[0] / squares[j];
    EXPECT_LT((projected.row(j).transpose() - u.col(j)).norm(), tolerance) << "component " << j;
    Eigen::Index largest = 0;
    u.col(j).cwiseAbs().maxCoeff(&largest);
    EXPECT_GT(u(largest, j), 0.0) << "sign of component " << j;
  }
}

TEST(Train, GivesLeftVectorsThatAreOrthonormalAndCentred) {
  const Eigen::MatrixXd& u = test::full_basis().left_vectors;
  const Eigen::MatrixXd product = u.transpose() * u;
  EXPECT_LT((product - Eigen::MatrixXd::Identity(u.cols(), u.cols())).norm(), 1e-12);
  EXPECT_LT(u.colwise().sum().cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Train, CutsTheComponentsToTheRank) {
  EXPECT_LE(test::full_basis().component_count(), 3 * test::kMaterials - 1);
  EXPECT_EQ(test::full_basis().singular_values.size(), 3 * test::kMaterials - 1);

  TrainingSet grey(brdf::RadiometricScale::si);  // R = G = B: at most one direction
  grey.add({"a", "", ""}, test::Lobe(brdf::Rgb::Constant(0.1), brdf::Rgb::Constant(1.0), 0.2));
  grey.add({"b", "", ""}, test::Lobe(brdf::Rgb::Constant(0.2), brdf::Rgb::Constant(9.0), 0.1));
  EXPECT_EQ(train(grey, centred_gram(grey)).component_count(), 1);
}

TEST(Train, GivesTheSameBytesWithOneAndTwoThreads) {
  const auto run = [](unsigned threads) {
    parallel::set_thread_count(threads);
    const Eigen::MatrixXd gram = centred_gram(test::training_set());
    return train(test::training_set(), gram, 12);
  };
  const Basis one = run(1);
  const Basis two = run(2);
  parallel::set_thread_count(0);
  EXPECT_EQ(one.singular_values, two.singular_values);
  EXPECT_EQ(one.mean, two.mean);
  EXPECT_EQ(one.components, two.components);
}

TEST(Train, RefusesTooFewMaterialsAndForeignInput) {
  const TrainingSet& set = test::training_set();
  const Eigen::MatrixXd& gram = test::training_gram();
  EXPECT_THROW(train(set, gram, std::vector<std::size_t>{1}), NumericalError);
  EXPECT_THROW(train(set, gram, std::vector<std::size_t>{2, 1}), std::invalid_argument);
  EXPECT_THROW(train(set, gram, std::vector<std::size_t>{1, test::kMaterials}),
               std::invalid_argument);
  EXPECT_THROW(train(set, gram, 0), std::invalid_argument);
  EXPECT_THROW(train(set, Eigen::MatrixXd(gram.topLeftCorner(3, 3))), std::invalid_argument);

  TrainingSet twins(brdf::RadiometricScale::si);
  const test::Lobe grey(brdf::Rgb::Constant(0.1), brdf::Rgb::Constant(1.0), 0.2);
  twins.add({"a", "", ""}, grey);
  twins.add({"b", "", ""}, grey);
  EXPECT_THROW(train(twins, centred_gram(twins)), NumericalError);
}

}  // namespace
}  // namespace gonio::basis
