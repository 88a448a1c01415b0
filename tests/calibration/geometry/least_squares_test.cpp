#include "gonio/calibration/geometry/least_squares.h"

#include <gmock/gmock.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "gonio/errors/errors.h"
#include "gonio/random/stream.h"

namespace gonio::calibration::geometry {
namespace {

using Eigen::VectorXd;

/// y = a exp(b x) + c with noise, in blocks that each have a level c of their own.
LeastSquaresProblem decay(std::uint64_t seed, double noise, int blocks = 5, int points = 12) {
  random::Stream stream(random::make_key(seed, "decay"));
  LeastSquaresProblem problem;
  problem.global = VectorXd::Zero(2);
  problem.global[0] = 1.0;
  problem.global_step = VectorXd::Constant(2, 1e-5);
  for (int b = 0; b < blocks; ++b) {
    VectorXd y(points);
    for (int k = 0; k < points; ++k) {
      y[k] = 3.0 * std::exp(-0.7 * k / 4.0) + 0.5 * b + noise * stream.normal();
    }
    ResidualBlock block;
    block.observed = points;
    block.local = VectorXd::Zero(1);
    block.local_step = VectorXd::Constant(1, 1e-5);
    block.residual = [y](const VectorXd& global, const VectorXd& local,
                         Eigen::Ref<VectorXd> residual) {
      for (Eigen::Index k = 0; k < y.size(); ++k) {
        residual[k] =
            y[k] - global[0] * std::exp(global[1] * static_cast<double>(k) / 4.0) - local[0];
      }
    };
    problem.blocks.push_back(std::move(block));
  }
  return problem;
}

TEST(LeastSquares, FindsExactUnknownsOfAllKinds) {
  const auto solution = solve(decay(1, 0.0));
  constexpr double kTolerance = 1e-7;
  EXPECT_NEAR(solution.global[0], 3.0, kTolerance);
  EXPECT_NEAR(solution.global[1], -0.7, kTolerance);
  for (int b = 0; b < 5; ++b) EXPECT_NEAR(solution.local[b][0], 0.5 * b, kTolerance);
}

// The Schur complement is another way to the same: a straight line with free levels against the
// textbook's normal equations of all unknowns at once.
TEST(LeastSquares, CovarianceIsThatOfTheDenseNormalEquations) {
  random::Stream stream(random::make_key(2, "line"));
  constexpr int kBlocks = 3;
  constexpr int kPoints = 6;
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(kBlocks * kPoints, 1 + kBlocks);
  VectorXd y(kBlocks * kPoints);
  LeastSquaresProblem problem;
  problem.global = VectorXd::Zero(1);
  problem.global_step = VectorXd::Constant(1, 1e-3);
  for (int b = 0; b < kBlocks; ++b) {
    for (int k = 0; k < kPoints; ++k) {
      design(b * kPoints + k, 0) = k + b;
      design(b * kPoints + k, 1 + b) = 1.0;
    }
    for (int k = 0; k < kPoints; ++k) y[b * kPoints + k] = 2.0 * (k + b) + 0.3 * stream.normal();
    const VectorXd own = y.segment(b * kPoints, kPoints);
    ResidualBlock block;
    block.observed = kPoints;
    block.local = VectorXd::Zero(1);
    block.local_step = VectorXd::Constant(1, 1e-3);
    block.residual = [own, b](const VectorXd& slope, const VectorXd& level,
                              Eigen::Ref<VectorXd> residual) {
      for (Eigen::Index k = 0; k < own.size(); ++k) {
        residual[k] = own[k] - slope[0] * static_cast<double>(k + b) - level[0];
      }
    };
    problem.blocks.push_back(std::move(block));
  }
  problem.huber_sigmas = 100.0;  // plain least squares
  const auto solution = solve(problem);

  const Eigen::MatrixXd inverse = (design.transpose() * design).inverse();
  const VectorXd expected = inverse * design.transpose() * y;
  const double variance =
      (y - design * expected).squaredNorm() / static_cast<double>(design.rows() - design.cols());
  EXPECT_NEAR(solution.global[0], expected[0], 1e-8);
  EXPECT_NEAR(solution.local[2][0], expected[3], 1e-8);
  // sigma is found to a hundredth, the rest of the scale follows from chi2.
  EXPECT_NEAR(solution.covariance(0, 0) / (variance * inverse(0, 0)), 1.0, 1e-3 + 0.02);
  EXPECT_NEAR(solution.sigma * solution.sigma * solution.chi2_per_dof / variance, 1.0, 1e-3);
  EXPECT_EQ(solution.degrees_of_freedom, design.rows() - design.cols());
}

TEST(LeastSquares, FindsTheNoiseItself) {
  double sum = 0.0;
  constexpr int kSeeds = 20;
  for (int seed = 0; seed < kSeeds; ++seed) sum += solve(decay(100 + seed, 0.02)).sigma;
  EXPECT_NEAR(sum / kSeeds, 0.02, 0.0008);  // 60 points: one seed is good to 10 %
}

TEST(LeastSquares, AnOutlierHardlyMovesTheResult) {
  const auto clean = solve(decay(3, 0.01, 5, 40));
  auto problem = decay(3, 0.01, 5, 40);
  const auto model = problem.blocks[0].residual;
  problem.blocks[0].residual = [model](const VectorXd& global, const VectorXd& local,
                                       Eigen::Ref<VectorXd> residual) {
    model(global, local, residual);
    residual[3] += 5.0;  // 500 sigma
  };
  const auto hit = solve(problem);
  const double uncertainty = std::sqrt(clean.covariance(0, 0));
  EXPECT_LT(std::abs(hit.global[0] - clean.global[0]), uncertainty);
  EXPECT_LT(std::sqrt(hit.covariance(0, 0)), 1.3 * uncertainty);
}

TEST(LeastSquares, APriorCountsAsMuchAsItsUncertaintySays) {
  // One observation 1 +- 1 (sigma given) and a prior 3 +- 0.5: the weighted mean is 2.6.
  LeastSquaresProblem problem;
  problem.global = VectorXd::Zero(1);
  problem.global_step = VectorXd::Constant(1, 1e-3);
  problem.estimate_sigma = false;
  ResidualBlock block;
  block.observed = 1;
  block.priors = 1;
  block.residual = [](const VectorXd& x, const VectorXd&, Eigen::Ref<VectorXd> residual) {
    residual[0] = 1.0 - x[0];
    residual[1] = (3.0 - x[0]) / 0.5;
  };
  problem.blocks.push_back(block);
  EXPECT_NEAR(solve(problem).global[0], 2.6, 1e-9);
}

TEST(LeastSquares, PassesOnWhatAConsideredUnknownMayBeOff) {
  // y = x + c, c considered known as 1 +- 0.2: x takes over its uncertainty with opposite sign.
  random::Stream stream(random::make_key(4, "considered"));
  LeastSquaresProblem problem;
  problem.global = VectorXd::Zero(2);
  problem.global[1] = 1.0;
  problem.global_step = VectorXd::Constant(2, 1e-3);
  problem.considered_covariance = Eigen::MatrixXd::Constant(1, 1, 0.04);
  ResidualBlock block;
  block.observed = 20;
  VectorXd y(20);
  for (double& value : y) value = 5.0 + 1e-6 * stream.normal();
  block.residual = [y](const VectorXd& x, const VectorXd&, Eigen::Ref<VectorXd> residual) {
    residual = y.array() - (x[0] + x[1]);
  };
  problem.blocks.push_back(block);
  const auto solution = solve(problem);
  EXPECT_EQ(solution.global[1], 1.0);
  EXPECT_NEAR(solution.global[0], 4.0, 1e-5);
  EXPECT_NEAR(solution.covariance(0, 0), 0.04, 1e-9);
  EXPECT_NEAR(solution.covariance(0, 1), -0.04, 1e-9);
}

TEST(LeastSquares, RefusesWhatTheObservationsDoNotDetermine) {
  LeastSquaresProblem problem;
  problem.global = VectorXd::Zero(2);
  problem.global_step = VectorXd::Constant(2, 1e-3);
  ResidualBlock block;
  block.observed = 5;
  block.residual = [](const VectorXd& x, const VectorXd&, Eigen::Ref<VectorXd> residual) {
    residual = Eigen::VectorXd::LinSpaced(5, 0.0, 1.0).array() - (x[0] + x[1]);
  };
  problem.blocks.push_back(block);
  EXPECT_THROW(solve(problem), NumericalError);  // only the sum is observed
  problem.blocks[0].observed = 1;
  problem.blocks[0].residual = [](const VectorXd& x, const VectorXd&,
                                  Eigen::Ref<VectorXd> residual) { residual[0] = 1.0 - x[0]; };
  EXPECT_THROW(solve(problem), NumericalError);  // fewer observations than unknowns
}

TEST(LeastSquares, RefusesAnImpossibleStart) {
  auto problem = decay(5, 0.01);
  problem.blocks[1].residual = [](const VectorXd&, const VectorXd&, Eigen::Ref<VectorXd> residual) {
    residual.setConstant(std::numeric_limits<double>::quiet_NaN());
  };
  EXPECT_THROW(solve(problem), NumericalError);
}

TEST(LeastSquares, ChecksSizes) {
  auto problem = decay(6, 0.01);
  problem.global_step = VectorXd::Constant(1, 1e-3);
  EXPECT_THROW(solve(problem), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::calibration::geometry
