#include "gonio/design/criteria.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "design_fixture.h"

namespace gonio::design {
namespace {

TEST(OpenShare, IsTheWholePriorWithoutSamples) {
  EXPECT_EQ(open_share(Eigen::MatrixXd(0, 4), 0.3),
            Eigen::MatrixXd(Eigen::MatrixXd::Identity(4, 4)));
}

TEST(OpenShare, IsTheSameFromFewAndFromManySamples) {
  // The two ways of solving meet where a sample that says nothing is added.
  const Eigen::MatrixXd few = made_up_rows(5, 6).cast<double>();
  Eigen::MatrixXd many = Eigen::MatrixXd::Zero(9, 6);
  many.topRows(5) = few;
  EXPECT_LT((open_share(few, 0.3) - open_share(many, 0.3)).norm(), kRounding);
}

TEST(OpenShare, RefusesAnEtaThatIsNotPositive) {
  EXPECT_THROW(open_share(Eigen::MatrixXd::Ones(2, 2), 0.0), std::invalid_argument);
  EXPECT_THROW(open_share(Eigen::MatrixXd::Ones(2, 2), std::nan("")), std::invalid_argument);
}

// Draws materials from the prior, measures them with noise, solves the least-squares problem that
// ridge stands for as one stacked system, and weighs what is left.
TEST(BayesA, IsTheMeanSquareErrorOfTheSolve) {
  const Eigen::Index k = 4;
  const double m = 30.0;
  const double eta = 0.8;
  const double sigma = std::sqrt(eta / m);
  const Eigen::MatrixXd rows = made_up_rows(3, k).cast<double>();
  const Eigen::MatrixXd shape = made_up_rows(40, k, 5).cast<double>();
  const Eigen::MatrixXd importance = shape.transpose() * shape / 40.0;

  Eigen::MatrixXd stacked(3 + k, k);
  stacked << rows / sigma, Eigen::MatrixXd::Identity(k, k) * std::sqrt(m);
  const Eigen::LDLT<Eigen::MatrixXd> solver(stacked.transpose() * stacked);
  const random::Key key = random::make_key(1, "test.bayes_a");
  std::uint64_t at = 0;
  const auto normal = [&](Eigen::Index size) {
    return Eigen::VectorXd(
        Eigen::VectorXd::NullaryExpr(size, [&] { return random::normal(key, at++); }));
  };
  double sum = 0.0;
  constexpr int kDraws = 20000;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::VectorXd truth = normal(k) / std::sqrt(m);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(3 + k);
    right.head(3) = (rows * truth + sigma * normal(3)) / sigma;
    const Eigen::VectorXd error = solver.solve(stacked.transpose() * right) - truth;
    sum += error.dot(importance * error);
  }
  EXPECT_NEAR(m * sum / kDraws / criterion_value(Criterion::bayes_a, rows, importance, eta), 1.0,
              kMonteCarlo);
}

TEST(BayesD, IsTheLogVolumeForFewAndForManySamples) {
  const Eigen::MatrixXd importance = Eigen::MatrixXd::Identity(5, 5);
  for (const Eigen::Index n : {2, 5, 9}) {
    const Eigen::MatrixXd rows = made_up_rows(n, 5).cast<double>();
    // Each principal direction, of squared length s, shrinks by eta / (s + eta).
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(rows.transpose() * rows);
    double expected = 0.0;
    for (const double s : eigen.eigenvalues()) expected += std::log(0.7 / (s + 0.7));
    EXPECT_NEAR(criterion_value(Criterion::bayes_d, rows, importance, 0.7), expected, kRounding);
  }
  EXPECT_EQ(criterion_value(Criterion::bayes_d, Eigen::MatrixXd(0, 5), importance, 0.7), 0.0);
}

TEST(ConditionNumber, UsesAsManyColumnsAsThereAreRows) {
  Eigen::MatrixXd rows(2, 3);
  rows << 8.0, 0.0, 100.0,  //
      0.0, 2.0, 100.0;
  EXPECT_NEAR(condition_number(rows), 4.0, kRounding);
}

TEST(ConditionNumber, IsInfiniteForARepeatedRow) {
  Eigen::MatrixXd rows(2, 2);
  rows << 1.0, 2.0, 1.0, 2.0;
  EXPECT_TRUE(std::isinf(condition_number(rows)));
  EXPECT_TRUE(std::isinf(condition_number(Eigen::MatrixXd(0, 3))));
}

/// A small training set X and its whole SVD, k = m - 1.
struct WholeSvd {
  WholeSvd() {
    const Eigen::MatrixXd x =
        made_up_rows(12, 70, 3).cast<double>() +
        Eigen::MatrixXd::Ones(12, 1) * Eigen::RowVectorXd::LinSpaced(70, 0, 9);
    centred = x.rowwise() - x.colwise().mean();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(centred * centred.transpose());
    left = eigen.eigenvectors().rightCols(11).rowwise().reverse();
    singular = eigen.eigenvalues().tail(11).reverse().cwiseSqrt();
    q = centred.transpose() * left;
  }
  Eigen::MatrixXd centred, left, q;
  Eigen::VectorXd singular;
};

// E(S) = mean_i || Q (Q^+ - (SQ)^+_eta S) y_i || with p x p matrices, as published.
TEST(XuMetric, EqualsTheDenseDefinition) {
  const WholeSvd training;
  const std::vector<Eigen::Index> cells = {3, 17, 40, 66};
  const double eta = 2.5;
  Eigen::MatrixXd select = Eigen::MatrixXd::Zero(4, 70);
  for (Eigen::Index i = 0; i < 4; ++i) select(i, cells[static_cast<std::size_t>(i)]) = 1.0;
  const Eigen::MatrixXd a = select * training.q;
  const Eigen::MatrixXd pseudo =
      (training.q.transpose() * training.q).inverse() * training.q.transpose();
  const Eigen::MatrixXd ridge =
      (a.transpose() * a + eta * Eigen::MatrixXd::Identity(11, 11)).inverse() * a.transpose();
  const Eigen::MatrixXd error_of = training.q * (pseudo - ridge * select);
  double dense = 0.0;
  for (Eigen::Index i = 0; i < 12; ++i) {
    dense += (error_of * training.centred.row(i).transpose()).norm() / 12.0;
  }
  EXPECT_NEAR(xu_metric(a, training.singular, training.left, eta), dense, kRounding * dense);
}

TEST(XuMetric, IsTheSameFromFewAndFromManySamples) {
  // The two ways of working it out meet where samples that say nothing are added.
  const WholeSvd training;
  const Eigen::MatrixXd few = training.q.topRows(4);
  Eigen::MatrixXd many = Eigen::MatrixXd::Zero(13, 11);
  many.topRows(4) = few;
  const double expected = xu_metric(many, training.singular, training.left, 2.5);
  EXPECT_NEAR(xu_metric(few, training.singular, training.left, 2.5), expected,
              kRounding * expected);
}

TEST(XuMetric, CountsWhatACutBasisLeavesOut) {
  // Without samples the error is the training set itself.
  const WholeSvd training;
  const double whole = xu_metric(Eigen::MatrixXd(0, 11), training.singular, training.left, 1.0);
  EXPECT_NEAR(whole, training.centred.rowwise().norm().mean(), kRounding * whole);

  const double root_mean_square = std::sqrt(training.centred.squaredNorm() / 12.0);
  const double left_out = std::sqrt(training.singular.tail(8).squaredNorm() / 12.0);
  const double cut = xu_metric(Eigen::MatrixXd(0, 3), training.singular, training.left, 1.0);
  EXPECT_GT(cut, left_out);
  EXPECT_LE(cut, root_mean_square * (1.0 + kRounding));
  const Eigen::VectorXd kept = training.singular.head(3);
  EXPECT_GT(cut, xu_metric(Eigen::MatrixXd(0, 3), kept, training.left, 1.0));
}

TEST(XuMetric, RefusesMatricesThatDoNotFit) {
  const WholeSvd training;
  EXPECT_THROW(xu_metric(training.q.topRows(4), training.singular.head(3), training.left, 1.0),
               std::invalid_argument);
}

}  // namespace
}  // namespace gonio::design
