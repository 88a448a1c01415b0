#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <stop_token>
#include <vector>

#include "gonio/basis/basis.h"
#include "gonio/design/candidates.h"
#include "gonio/design/search.h"

namespace gonio::design {

/// Exact leave-one-material-out prediction from n samples, in the k dimensions of the basis.
///
/// Every material's three rows are predicted from their samples by the ridge fit that the other
/// materials alone would give (the mean over all of them stays). With M = open_share(), P = I - M
/// and U_g the material's rows of U, the errors in the coefficients are
///
///     R_g = (I - U_g P U_g^T)^-1 U_g M      (3 x k, exact up to the components left out)
///
/// so nothing of the size of the lattice is needed. Noise of variance s_j^2 at sample j adds
/// sum_j s_j^2 (M a_j / eta_j)^T K (M a_j / eta_j) to everybody's expected square error.
/// Source  Allen's PRESS for blocks of rows ("The Relationship Between Variable Selection and Data
///         Augmentation", Technometrics 16(1), 1974), on the Gram matrix of the training set.
struct LeaveOneOut {
  Eigen::MatrixXd residuals;  ///< m x k: error of each training row's coefficients, no noise
  Eigen::VectorXd errors;  ///< per material, mean over its channels: expected importance-weighted
                           ///< square error, noise included
  double noise = 0.0;      ///< what of `errors` is noise, the same for all
};

/// `rows`          n x k, rows of Q at the samples (rows_at()).
/// `left_vectors`  U, m x k, orthonormal columns; three rows per material.
/// `importance`    k x k.
/// `noise`         n, m sigma^2 of each sample's own noise; empty: none. The solve is told
///                 eta + noise.
/// Throws          std::invalid_argument for shapes that do not fit, eta not above 0.
LeaveOneOut leave_one_out(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& left_vectors,
                          const Eigen::MatrixXd& importance, double eta,
                          const Eigen::VectorXd& noise = {});

/// Up to so many points leave_one_out_exchange() after exchange() is worth it: held out, five
/// points gain 0.1 dB, while at ten the mean stays and the worst materials lose (docs/results.md).
inline constexpr int kLeaveOneOutPoints = 5;

struct LeaveOneOutOptions {
  double eta = 0.3;  ///< m times the variance the solve allows for besides the noise, > 0
  /// Errors below this share of the expected error without samples, tr(K)/m, count no more: the
  /// mean logarithm would otherwise care for materials that are already perfect.
  double floor_share = 1e-4;
  int random_cells = 2000;  ///< drawn for each sample and sweep
  int descents = 6;         ///< how many of the best are followed to a lattice minimum
  int sweeps = 4;           ///< over all samples at most; ends before when a sweep changes nothing
  std::uint64_t seed = 1;

  /// Throws std::invalid_argument naming the field.
  void validate() const;
};

/// J = mean over materials of log10(error + floor): what leave_one_out_exchange() lowers.
double leave_one_out_value(const LeaveOneOut& found, const Eigen::MatrixXd& importance,
                           double floor_share);

/// Lowers J from a design that another search has found: one sample after another is taken out and
/// the best of random cells and their lattice neighbours put in its place. Unlike the criteria of
/// exchange() J knows the materials: it asks for a set from which each would have been predicted by
/// the others, on a scale on which a decibel is a decibel for dark and bright ones.
///
/// `rows`        p x k, p = basis_cell_count(). Only the rows of tried cells are read.
/// `start`       Distinct allowed cells, at least one.
/// Value         J; -1 is a tenth of the square error.
/// Time          About 0.1 s for 10 samples, k = 80, 90 materials, on two cores.
/// Stop          Between samples: the best so far.
/// Threads       Uses all; the same bytes with any number.
/// Errors        std::invalid_argument: shapes, options, a start that is not allowed.
Design leave_one_out_exchange(const basis::RowMajorMatrixXf& rows,
                              const Eigen::MatrixXd& left_vectors,
                              const Eigen::MatrixXd& importance, const Candidates& candidates,
                              const std::vector<std::uint32_t>& start,
                              const LeaveOneOutOptions& options,
                              const ProgressCallback& progress = {},
                              const std::stop_token& stop = {});

}  // namespace gonio::design
