#include "row_prior.h"

#include <Eigen/LU>
#include <algorithm>
#include <vector>

#include "gonio/basis/siblings.h"

namespace gonio::basis::detail {
namespace {

constexpr std::size_t kFewestMaterials = 12;
constexpr int kRounds = 3;
/// Rows count in full up to this many times the median chi^2.
constexpr double kUsual = 1.5;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

RowPrior with_weights(const Basis& basis, Eigen::VectorXd weight) {
  RowPrior prior;
  prior.mass = weight.sum();
  prior.mean = basis.left_vectors.transpose() * weight / prior.mass;
  prior.weight = std::move(weight);
  return prior;
}

/// Mean over a group's rows of y^T (R + A C A^T)^-1 y, y = A v and C the prior's covariance without
/// the group.
std::vector<double> left_out_chi2(const Basis& basis, const NormalEquations& equations,
                                  const RowPrior& prior,
                                  const std::vector<std::vector<Eigen::Index>>& groups) {
  const Eigen::MatrixXd v = basis.left_vectors.rowwise() - prior.mean.transpose();
  const Eigen::MatrixXd& information = equations.information;
  // With C = V^T W V / mass:  A^T (R + A C A^T)^-1 A = (1 + I C)^-1 I, I = A^T R^-1 A.
  const Eigen::MatrixXd covariance = v.transpose() * prior.weight.asDiagonal() * v / prior.mass;
  Eigen::MatrixXd system = information * covariance;
  system.diagonal().array() += 1.0;
  const Eigen::MatrixXd explained = v * system.partialPivLu().solve(information);
  std::vector<double> chi2;
  for (const std::vector<Eigen::Index>& rows : groups) {
    const Eigen::MatrixXd h = explained(rows, Eigen::all) * v(rows, Eigen::all).transpose();
    // Taking the group's rows out of C is a low-rank change.
    Eigen::MatrixXd rest = -h * prior.weight(rows).asDiagonal() / prior.mass;
    rest.diagonal().array() += 1.0;
    chi2.push_back(rest.partialPivLu().solve(h).trace() / static_cast<double>(rows.size()));
  }
  return chi2;
}

}  // namespace

RowPrior uniform_prior(const Basis& basis) {
  RowPrior prior;
  prior.weight.setOnes(basis.row_count());
  prior.mean.setZero(basis.component_count());
  prior.mass = basis.row_count();
  return prior;
}

RowPrior heavy_tailed_prior(const Basis& basis, const NormalEquations& equations) {
  RowPrior prior = uniform_prior(basis);
  const std::vector<std::vector<Eigen::Index>> groups = rows_of_groups(basis);
  if (groups.size() < kFewestMaterials) return prior;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> chi2 = left_out_chi2(basis, equations, prior, groups);
    const double usual = kUsual * median(chi2);
    Eigen::VectorXd weight(basis.row_count());
    for (std::size_t group = 0; group < groups.size(); ++group) {
      weight(groups[group]).setConstant(chi2[group] > usual ? usual / chi2[group] : 1.0);
    }
    prior = with_weights(basis, std::move(weight));
  }
  return prior;
}

}  // namespace gonio::basis::detail
