#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace gonio::calibration::geometry {

/// The observations that share local unknowns: the view of a board with its pose, say.
struct ResidualBlock {
  /// Length of the first part of the residual: observed minus model, in the unit of
  /// LeastSquaresProblem::sigma, a multiple of LeastSquaresProblem::components. Robust.
  Eigen::Index observed = 0;
  /// Length of the rest: prior knowledge about unknowns, in units of its own standard uncertainty.
  Eigen::Index priors = 0;
  Eigen::VectorXd local;       ///< start of the local unknowns; may be empty
  Eigen::VectorXd local_step;  ///< steps of their numeric derivatives
  /// Fills `residual` (observed + priors). Not a number says that the unknowns are impossible
  /// there, a point behind the camera say: the step that led there is taken back.
  std::function<void(const Eigen::VectorXd& global, const Eigen::VectorXd& local,
                     Eigen::Ref<Eigen::VectorXd> residual)>
      residual;
};

/// What to minimise: sum over observations of Huber(|observation| / sigma) + sum of priors squared.
struct LeastSquaresProblem {
  Eigen::VectorXd global;       ///< start of the unknowns of all blocks
  Eigen::VectorXd global_step;  ///< steps of the numeric (central) derivatives, all above 0
  /// The last so many of `global` stay as given, known from elsewhere with this covariance: it
  /// goes into that of the result ("consider" parameters: Schmidt, "Application of state space
  /// methods to navigation problems", Advances in Control Systems 3, 1966).
  Eigen::MatrixXd considered_covariance;  ///< square; empty: none
  std::vector<ResidualBlock> blocks;
  Eigen::Index components = 1;  ///< residuals that make one observation: 2 for a pixel
  double sigma = 1.0;           ///< standard deviation of one component of an observation
  /// `sigma` is only a start: it is found from the residuals, each weighted by its redundancy
  /// (Förstner, variance components).
  bool estimate_sigma = true;
  double huber_sigmas = 3.0;  ///< beyond it an observation weighs as the inverse of its distance
};

struct LeastSquaresSolution {
  Eigen::VectorXd global;
  std::vector<Eigen::VectorXd> local;
  /// Of `global`, by J^T J at the solution times chi2_per_dof where that is above 1, and the
  /// considered part.
  Eigen::MatrixXd covariance;
  std::vector<Eigen::VectorXd> residuals;  ///< per block, as ResidualBlock::residual gave them
  double sigma = 0.0;
  /// Robust sum of squares in units of sigma and of the priors, over the degrees of freedom.
  double chi2_per_dof = 0.0;
  Eigen::Index degrees_of_freedom = 0;
  int iterations = 0;
};

/// Levenberg-Marquardt with numeric derivatives; the local unknowns are eliminated block by block
/// (Schur complement), so that time grows with the number of blocks and not with its cube.
///
/// Threads  Any; the residual functions are called on the caller's.
/// Errors   NumericalError: no convergence, fewer observations than unknowns, unknowns that the
///          observations do not determine, a start that is impossible. std::invalid_argument:
///          sizes that do not fit.
/// Source   Triggs, McLauchlan, Hartley, Fitzgibbon, "Bundle Adjustment - A Modern Synthesis",
///          2000, sections 3.3, 4 and 6.1; Huber, "Robust Statistics", 1981, section 7.
LeastSquaresSolution solve(const LeastSquaresProblem& problem);

}  // namespace gonio::calibration::geometry
