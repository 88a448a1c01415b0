#pragma once

#include <Eigen/Core>

#include "gonio/basis/basis.h"
#include "gonio/brdf/brdf_table.h"

namespace gonio::basis {

/// Mapped values x = mean + Q c at all cells above the horizon, for metrics that work in the
/// mapped domain and need no table.
///
/// `coefficients`  k x 3, or with fewer rows: the first components only.
/// Returns         p x 3, a column per channel.
Eigen::MatrixXf mapped_field(const Basis& basis, const Eigen::MatrixXd& coefficients);

/// Coefficients that come nearest to a field known at all cells (unweighted least squares): what
/// the span of the training materials can express at best.
///
/// `field`   p x 3 mapped values, as from mapped_values(); a cell that is not finite counts as if
///           it were the mean.
/// Returns   k x 3.
/// Throws    std::invalid_argument for another shape.
Eigen::MatrixXd project(const Basis& basis, const Eigen::MatrixXf& field);

/// The whole BRDF of some coefficients; negatives clamped at 0.
brdf::BrdfTable expand(const Basis& basis, const Eigen::MatrixXd& coefficients);

/// The whole BRDF of some mapped values, p x 3 as from mapped_field(); negatives clamped at 0.
/// Throws std::invalid_argument for another shape.
brdf::BrdfTable table_of(const Basis& basis, const Eigen::MatrixXf& field);

}  // namespace gonio::basis
