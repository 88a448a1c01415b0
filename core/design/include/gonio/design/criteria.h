#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>

#include "gonio/basis/basis.h"

namespace gonio::design {

/// What is minimised over sets of n directions. With the rows A (n x k) of Q at the directions and
/// eta = m sigma^2 (m training rows, noise sigma in nepers), M = eta (A^T A + eta I)^-1 is the
/// share of the prior that n samples leave open.
///
///   bayes_a     tr(K M)         expected squared error, noise included. The default.
///   xu_squared  tr(M K M)       squared error of noise-free training rows, K = Sigma^2 for the
///                               unweighted metric of Xu et al. 2016 (its mean of squares).
///   bayes_d     ln det M        volume of what is left open.
enum class Criterion { bayes_a, xu_squared, bayes_d };

/// M (k x k) for the rows of a design; the identity for no rows.
/// Throws std::invalid_argument unless eta > 0 and finite.
Eigen::MatrixXd open_share(const Eigen::MatrixXd& rows, double eta);

/// The criterion of a design, computed from scratch in double.
double criterion_value(Criterion criterion, const Eigen::MatrixXd& rows,
                       const Eigen::MatrixXd& importance, double eta);

/// Ratio of the largest to the smallest singular value of the first min(n, k) columns of `rows`
/// (n x k): what Nielsen et al. 2015 minimise. Infinite when a singular value is 0 to rounding or
/// there are no rows. It says little about quality: see docs/results.md.
double condition_number(const Eigen::MatrixXd& rows);

/// Mean error of the reconstructed training rows, over materials and channels: the metric of Xu,
/// Nielsen et al. 2016, in the k dimensions of the basis instead of the p of the lattice.
///
///     e_i = || Sigma (I - A^T (A A^T + eta I)^-1 A) u_i || ,   E = mean_i e_i
///
/// `rows`             n x k, the first k columns of Q at the directions.
/// `singular_values`  At least k, descending; those beyond k are what the basis leaves out: their
///                    energy is added to every e_i^2 in equal parts (a row's own part is unknown).
/// `left_vectors`     U, m x at least k: which combination of components each training row is, as
///                    Basis::left_vectors.
///                    With k = m - 1 the result is that of the published dense formula.
/// Unit               Nepers times sqrt(cells).
/// Source             "Minimal BRDF Sampling for Two-Shot Near-Field Reflectance Acquisition",
///                    ACM TOG 35(6), 2016, equation 12 without its noise term.
double xu_metric(const Eigen::MatrixXd& rows, const Eigen::VectorXd& singular_values,
                 const Eigen::MatrixXd& left_vectors, double eta);

/// Everything that is quoted about a set of directions before anything is measured.
struct DesignFigures {
  double condition_number = std::numeric_limits<double>::infinity();
  double xu_metric = 0.0;  ///< at the published eta = 40
  double bayes_a = 0.0;    ///< expected importance-weighted mean square error, nepers^2
  double bayes_d = 0.0;
};

/// `rows` n x k. `eta` is the search's; the published metric keeps its own 40. The solve has an eta
/// of its own (ReconstructOptions::model_eta), so these are figures of the design, not of a result.
DesignFigures assess(const basis::Basis& basis, const Eigen::MatrixXd& rows,
                     const Eigen::MatrixXd& importance, double eta);

/// Rows of Q (n x k) at lattice-free directions, interpolated.
/// Throws std::invalid_argument when a direction is below the horizon.
Eigen::MatrixXd rows_at(const basis::BasisRows& rows, std::span<const brdf::HalfDiff> directions);

}  // namespace gonio::design
