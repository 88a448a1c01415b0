#include "gonio/calibration/geometry/least_squares.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "gonio/errors/errors.h"

namespace gonio::calibration::geometry {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kMaxIterations = 100;
constexpr int kMaxPasses = 6;  // of finding sigma
constexpr double kFirstDamping = 1e-4;
constexpr double kMinDamping = 1e-15;
constexpr double kMaxDamping = 1e12;
constexpr double kSmallGain = 1e-9;       // of the sum of squares, in one step: converged
constexpr double kSigmaTolerance = 0.01;  // far below what the observations tell about sigma
constexpr double kSingular = 1e-13;       // smallest eigenvalue of the scaled normal matrix

struct State {
  VectorXd global;
  std::vector<VectorXd> local;
};

Index length(const ResidualBlock& block) { return block.observed + block.priors; }

VectorXd residual_at(const ResidualBlock& block, const VectorXd& global, const VectorXd& local) {
  VectorXd residual(length(block));
  block.residual(global, local, residual);
  return residual;
}

/// Distance of an observation from its model in units of sigma.
double distance(const LeastSquaresProblem& problem, const VectorXd& residual, Index first,
                double sigma) {
  return residual.segment(first, problem.components).norm() / sigma;
}

/// Huber's loss, equal to the square in the middle.
double loss(double distance, double limit) {
  return distance <= limit ? distance * distance : limit * (2.0 * distance - limit);
}

/// Not a number where the unknowns are impossible.
double cost_of(const LeastSquaresProblem& problem, const std::vector<VectorXd>& residuals,
               double sigma) {
  double cost = 0.0;
  for (std::size_t b = 0; b < residuals.size(); ++b) {
    const ResidualBlock& block = problem.blocks[b];
    for (Index k = 0; k < block.observed; k += problem.components) {
      cost += loss(distance(problem, residuals[b], k, sigma), problem.huber_sigmas);
    }
    cost += residuals[b].tail(block.priors).squaredNorm();
  }
  return cost;
}

std::vector<VectorXd> residuals_of(const LeastSquaresProblem& problem, const State& state) {
  std::vector<VectorXd> residuals;
  residuals.reserve(problem.blocks.size());
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    residuals.push_back(residual_at(problem.blocks[b], state.global, state.local[b]));
  }
  return residuals;
}

/// Rows of one block, weighted and in units of sigma. Derivatives by the last globals may be left
/// at 0: only the covariance needs those by the considered ones.
struct Linearised {
  MatrixXd by_global;
  MatrixXd by_local;
  VectorXd residual;
};

Linearised linearise(const LeastSquaresProblem& problem, const ResidualBlock& block,
                     const VectorXd& global, const VectorXd& local, double sigma,
                     Index first_globals) {
  Linearised rows{MatrixXd::Zero(length(block), global.size()),
                  MatrixXd(length(block), local.size()), residual_at(block, global, local)};
  VectorXd moved = global;
  for (Index k = 0; k < first_globals; ++k) {
    const double step = problem.global_step[k];
    moved[k] = global[k] + step;
    const VectorXd above = residual_at(block, moved, local);
    moved[k] = global[k] - step;
    rows.by_global.col(k) = (above - residual_at(block, moved, local)) / (2.0 * step);
    moved[k] = global[k];
  }
  moved = local;
  for (Index k = 0; k < local.size(); ++k) {
    const double step = block.local_step[k];
    moved[k] = local[k] + step;
    const VectorXd above = residual_at(block, global, moved);
    moved[k] = local[k] - step;
    rows.by_local.col(k) = (above - residual_at(block, global, moved)) / (2.0 * step);
    moved[k] = local[k];
  }
  for (Index k = 0; k < block.observed; k += problem.components) {
    const double d = distance(problem, rows.residual, k, sigma);
    const double weight = d <= problem.huber_sigmas ? 1.0 : problem.huber_sigmas / d;
    const double factor = std::sqrt(weight) / sigma;
    rows.by_global.middleRows(k, problem.components) *= factor;
    rows.by_local.middleRows(k, problem.components) *= factor;
    rows.residual.segment(k, problem.components) *= factor;
  }
  return rows;
}

std::vector<Linearised> linearise_all(const LeastSquaresProblem& problem, const State& state,
                                      double sigma, Index first_globals) {
  std::vector<Linearised> all;
  all.reserve(problem.blocks.size());
  for (std::size_t b = 0; b < problem.blocks.size(); ++b) {
    all.push_back(
        linearise(problem, problem.blocks[b], state.global, state.local[b], sigma, first_globals));
    if (!all.back().by_global.allFinite() || !all.back().by_local.allFinite()) {
      throw NumericalError("least squares: the model has no derivative near its solution");
    }
  }
  return all;
}

/// Normal equations after the local unknowns are eliminated.
struct Reduced {
  MatrixXd matrix;                          // all globals, the considered ones too
  VectorXd gradient;                        // of all globals
  std::vector<Eigen::LLT<MatrixXd>> local;  // of each block's own normal matrix
  std::vector<MatrixXd> cross;              // J_local^T J_global
  std::vector<VectorXd> local_gradient;
};

Reduced reduce(const std::vector<Linearised>& rows, Index globals, double damping) {
  Reduced reduced;
  reduced.matrix = MatrixXd::Zero(globals, globals);
  reduced.gradient = VectorXd::Zero(globals);
  VectorXd diagonal = VectorXd::Zero(globals);
  for (const Linearised& block : rows) {
    reduced.matrix.noalias() += block.by_global.transpose() * block.by_global;
    reduced.gradient.noalias() += block.by_global.transpose() * block.residual;
    diagonal += block.by_global.colwise().squaredNorm();
    MatrixXd own = block.by_local.transpose() * block.by_local;
    own.diagonal() *= 1.0 + damping;
    reduced.local.emplace_back(own);
    reduced.cross.emplace_back(block.by_local.transpose() * block.by_global);
    reduced.local_gradient.emplace_back(block.by_local.transpose() * block.residual);
    if (own.size() == 0) continue;
    if (reduced.local.back().info() != Eigen::Success) {
      throw NumericalError("least squares: unknowns of one view are not determined by it");
    }
    const MatrixXd& cross = reduced.cross.back();
    reduced.matrix.noalias() -= cross.transpose() * reduced.local.back().solve(cross);
    reduced.gradient.noalias() -=
        cross.transpose() * reduced.local.back().solve(reduced.local_gradient.back());
  }
  reduced.matrix.diagonal() += damping * diagonal;
  return reduced;
}

/// Inverse of the free part; throws when the observations leave a direction open.
MatrixXd inverse_of(const MatrixXd& matrix) {
  if (matrix.size() == 0) return matrix;
  const VectorXd diagonal = matrix.diagonal();
  if (!(diagonal.minCoeff() > 0.0)) {
    throw NumericalError("least squares: an unknown has no effect on any observation");
  }
  const VectorXd scale = diagonal.cwiseSqrt().cwiseInverse();
  const MatrixXd scaled = scale.asDiagonal() * matrix * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scaled);
  if (!(eigen.eigenvalues().minCoeff() > kSingular)) {
    throw NumericalError("least squares: the observations do not determine all unknowns");
  }
  const MatrixXd inverse = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                           eigen.eigenvectors().transpose();
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

State moved_by(const State& state, const Reduced& reduced, Index free) {
  State trial = state;
  VectorXd step = VectorXd::Zero(state.global.size());
  const Eigen::LDLT<MatrixXd> factor(reduced.matrix.topLeftCorner(free, free));
  step.head(free) = -factor.solve(reduced.gradient.head(free));
  trial.global += step;
  for (std::size_t b = 0; b < trial.local.size(); ++b) {
    if (trial.local[b].size() == 0) continue;
    trial.local[b] -= reduced.local[b].solve(reduced.local_gradient[b] + reduced.cross[b] * step);
  }
  return trial;
}

/// Descends with sigma held; returns the number of derivatives taken.
int descend_to_minimum(const LeastSquaresProblem& problem, State& state, double sigma, Index free) {
  double cost = cost_of(problem, residuals_of(problem, state), sigma);
  if (!std::isfinite(cost)) {
    throw NumericalError("least squares: the model is impossible where the search starts");
  }
  double damping = kFirstDamping;
  for (int iteration = 1; iteration <= kMaxIterations; ++iteration) {
    const auto rows = linearise_all(problem, state, sigma, free);
    double gain = -1.0;
    while (gain < 0.0 && damping < kMaxDamping) {
      const State trial = moved_by(state, reduce(rows, state.global.size(), damping), free);
      const double trial_cost = cost_of(problem, residuals_of(problem, trial), sigma);
      gain = std::isfinite(trial_cost) ? cost - trial_cost : -1.0;
      if (gain >= 0.0) {
        state = trial;
        cost = trial_cost;
        damping = std::max(damping * 0.1, kMinDamping);
      } else if (std::isfinite(trial_cost) && -gain <= kSmallGain * cost) {
        return iteration;  // rounding is all that is left to gain
      } else {
        damping *= 10.0;
      }
    }
    if (gain < 0.0 || gain <= kSmallGain * cost) return iteration;
  }
  throw NumericalError("least squares: no convergence in " + std::to_string(kMaxIterations) +
                       " steps");
}

/// Mean of min(d, limit)^2 per component for normal noise: 1 but for what the limit cuts.
double clipped_variance(Index components, double limit) {
  const double density = std::exp(-0.5 * limit * limit);
  if (components == 2) return 1.0 - density;
  constexpr double kInverseRootTwoPi = 0.3989422804014327;
  const double beyond = 0.5 * std::erfc(limit / std::sqrt(2.0));  // one side
  return 1.0 - 2.0 * beyond - 2.0 * limit * kInverseRootTwoPi * density +
         2.0 * limit * limit * beyond;
}

/// How the residuals stand at the solution.
struct Spread {
  double observed = 0.0;    // robust sum of squares in units of sigma
  double redundancy = 0.0;  // of the observations: their number less what the fit took of them
  double priors = 0.0;
};

Spread spread_of(const LeastSquaresProblem& problem, const std::vector<VectorXd>& residuals,
                 const std::vector<Linearised>& rows, const Reduced& reduced,
                 const MatrixXd& inverse, double sigma) {
  const Index free = inverse.rows();
  Spread spread;
  for (std::size_t b = 0; b < rows.size(); ++b) {
    const ResidualBlock& block = problem.blocks[b];
    for (Index k = 0; k < block.observed; k += problem.components) {
      const double d = std::min(distance(problem, residuals[b], k, sigma), problem.huber_sigmas);
      spread.observed += d * d;
    }
    spread.priors += residuals[b].tail(block.priors).squaredNorm();
    // Leverage: trace of J cov J^T over the observed rows.
    MatrixXd by_global = rows[b].by_global.topLeftCorner(block.observed, free);
    double leverage = 0.0;
    if (block.local.size() > 0) {
      const MatrixXd by_local = rows[b].by_local.topRows(block.observed);
      const MatrixXd half = reduced.local[b].matrixL().solve(by_local.transpose());
      leverage += half.squaredNorm();
      by_global -= by_local * reduced.local[b].solve(reduced.cross[b].leftCols(free));
    }
    leverage += (by_global * inverse).cwiseProduct(by_global).sum();
    spread.redundancy += static_cast<double>(block.observed) - leverage;
  }
  spread.observed /= clipped_variance(problem.components, problem.huber_sigmas);
  return spread;
}

void check_sizes(const LeastSquaresProblem& problem) {
  const auto fits = [](const VectorXd& step, const VectorXd& value) {
    return step.size() == value.size() && (step.size() == 0 || step.minCoeff() > 0.0);
  };
  bool good = fits(problem.global_step, problem.global) && problem.sigma > 0.0 &&
              problem.huber_sigmas > 0.0 && (problem.components == 1 || problem.components == 2) &&
              problem.considered_covariance.rows() == problem.considered_covariance.cols() &&
              problem.considered_covariance.rows() <= problem.global.size();
  for (const ResidualBlock& block : problem.blocks) {
    good = good && fits(block.local_step, block.local) && block.residual != nullptr &&
           block.observed >= 0 && block.priors >= 0 && block.observed % problem.components == 0;
  }
  if (!good) throw std::invalid_argument("least squares: sizes or steps do not fit the unknowns");
}

/// Adds what the considered unknowns may be off by.
MatrixXd with_considered(const LeastSquaresProblem& problem, const Reduced& reduced,
                         const MatrixXd& own) {
  const Index considered = problem.considered_covariance.rows();
  const Index free = own.rows();
  MatrixXd all = MatrixXd::Zero(free + considered, free + considered);
  all.topLeftCorner(free, free) = own;
  if (considered == 0) return all;
  // d solution / d considered.
  const MatrixXd follows = -reduced.matrix.topLeftCorner(free, free)
                                .ldlt()
                                .solve(reduced.matrix.topRightCorner(free, considered));
  const MatrixXd shared = follows * problem.considered_covariance;
  all.topLeftCorner(free, free) += shared * follows.transpose();
  all.topRightCorner(free, considered) = shared;
  all.bottomLeftCorner(considered, free) = shared.transpose();
  all.bottomRightCorner(considered, considered) = problem.considered_covariance;
  return all;
}

}  // namespace

LeastSquaresSolution solve(const LeastSquaresProblem& problem) {
  check_sizes(problem);
  const Index free = problem.global.size() - problem.considered_covariance.rows();
  State state{problem.global, {}};
  Index dof = -free;
  for (const ResidualBlock& block : problem.blocks) {
    state.local.push_back(block.local);
    dof += length(block) - block.local.size();
  }
  if (dof < 1) {
    throw NumericalError("least squares: found " + std::to_string(dof) +
                         " more observations than unknowns, expected at least 1");
  }

  double sigma = problem.sigma;
  LeastSquaresSolution solution;
  for (int pass = 1;; ++pass) {
    solution.iterations += descend_to_minimum(problem, state, sigma, free);
    solution.residuals = residuals_of(problem, state);
    const auto rows = linearise_all(problem, state, sigma, state.global.size());
    const Reduced reduced = reduce(rows, state.global.size(), 0.0);
    const MatrixXd inverse = inverse_of(reduced.matrix.topLeftCorner(free, free));
    const Spread spread = spread_of(problem, solution.residuals, rows, reduced, inverse, sigma);
    solution.chi2_per_dof = (spread.observed + spread.priors) / static_cast<double>(dof);

    // Exact observations (tests of the algebra) have no sigma to find.
    const bool can_tell = spread.redundancy > 0.5 && spread.observed > 0.0;
    const double ratio =
        problem.estimate_sigma && can_tell ? std::sqrt(spread.observed / spread.redundancy) : 1.0;
    if (std::abs(ratio - 1.0) > kSigmaTolerance && pass < kMaxPasses) {
      sigma *= ratio;
      continue;
    }
    // Less scatter than was said is no reason to trust the priors more.
    solution.covariance =
        with_considered(problem, reduced, inverse * std::max(1.0, solution.chi2_per_dof));
    break;
  }
  solution.global = state.global;
  solution.local = state.local;
  solution.sigma = sigma;
  solution.degrees_of_freedom = dof;
  return solution;
}

}  // namespace gonio::calibration::geometry
