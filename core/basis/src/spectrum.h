#pragma once

#include <Eigen/Core>

namespace gonio::basis::detail {

/// What training needs of the Gram matrix of centred rows.
struct Spectrum {
  Eigen::VectorXd singular_values;  ///< all m - 1, descending, rounding below 0 cut off
  Eigen::MatrixXd left_vectors;     ///< m x k, orthonormal, columns sum to 0
};

/// `gram`             m x m around the rows' own mean, symmetric.
/// `component_count`  k; cut to the rank and to the singular values above `least`. At least 1.
/// Signs              Of each column the largest entry in size is positive.
/// Throws             NumericalError: not finite, or of rank 0.
Spectrum spectrum_of(const Eigen::MatrixXd& gram, int component_count, double least = 0.0);

}  // namespace gonio::basis::detail
