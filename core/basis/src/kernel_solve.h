#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <vector>

#include "gonio/basis/basis.h"
#include "normal_equations.h"
#include "row_prior.h"

namespace gonio::basis::detail {

/// How far a kernel departs from ridge. Two materials whose samples differ by d (root mean square
/// over the samples, nepers) are alike by amplitude / (1 + (d / length)^2) beyond what the linear
/// prior knows, in units of the noise. Amplitude 0 is ridge.
struct KernelShape {
  double amplitude = 0.0;
  double length = 0.7;
};

/// Kernel ridge regression from samples to coefficients over the training rows: the result is a
/// combination of the rows, those most like the samples counting most. With V = U - 1 mean^T,
/// Y = V A^T (what the samples would be on each training row) and W = diag(weight) of the prior,
///
///     K = Y R^-1 Y^T / mass + amplitude / (1 + D / length^2),   alpha = (K + W^-1)^-1 k(Y, y),
///     c = mean + V^T alpha.
///
/// Source  The linear part alone is ridge in its dual form (Saunders, Gammerman, Vovk, "Ridge
///         Regression Learning Algorithm in Dual Variables", ICML 1998); the rational quadratic
///         kernel with exponent 1: Rasmussen and Williams 2006, equation 4.19.
class KernelSolve {
 public:
  /// Holds references: basis and prior must outlive it.
  /// Throws NumericalError when K + W^-1 is not positive definite.
  KernelSolve(const Basis& basis, const RowPrior& prior, const NormalEquations& equations,
              const KernelShape& shape);

  /// k. The equations must be those of the constructor but for the values measured.
  Eigen::VectorXd coefficients(const NormalEquations& equations) const;

  /// What is left of each training row, as coefficients (m x k), when it is predicted from samples
  /// like these without the rows of its group (rows_of_groups()). The mean stays that of all rows.
  Eigen::MatrixXd leave_out(const std::vector<std::vector<Eigen::Index>>& groups) const;

 private:
  const Eigen::MatrixXd& left_vectors_;
  const RowPrior& prior_;
  KernelShape shape_;
  Eigen::VectorXd likeness_square_;  ///< m, u^T L u of every row
  Eigen::LLT<Eigen::MatrixXd> factor_;
};

}  // namespace gonio::basis::detail
