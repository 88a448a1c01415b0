#pragma once

#include <Eigen/Core>

#include "noise_model.h"

namespace gonio::basis::detail {

/// The samples of one channel seen from the coefficients: all a solver needs of them, in k
/// dimensions whatever the number of samples.
struct NormalEquations {
  Eigen::MatrixXd information;  ///< k x k, A^T R^-1 A
  Eigen::VectorXd right;        ///< k, A^T R^-1 (x - mu)
  double square = 0.0;          ///< (x - mu)^T R^-1 (x - mu)

  /// Mean square of a residual r = x - mu - A c over the samples, weighted by their precisions
  /// (which sum to 1): c^T likeness c - 2 c^T likeness_right + likeness_square.
  Eigen::MatrixXd likeness;  ///< k x k
  Eigen::VectorXd likeness_right;
  double likeness_square = 0.0;

  /// r^T R^-1 r of the residual of some coefficients.
  double chi2(const Eigen::VectorXd& coefficients) const;
};

/// Forms them. A pose's block of R is diagonal plus a few columns, so that its inverse costs
/// as much as a diagonal one (Woodbury).
NormalEquations normal_equations(const SampleRows& rows, const MappedSamples& mapped);

}  // namespace gonio::basis::detail
