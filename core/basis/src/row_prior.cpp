#include "row_prior.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "gonio/basis/siblings.h"

namespace gonio::basis::detail {
namespace {

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

}  // namespace

std::vector<double> left_out_chi2(const Basis& basis, const NormalEquations& equations,
                                  const RowPrior& prior,
                                  const std::vector<std::vector<Eigen::Index>>& groups) {
  const Eigen::MatrixXd v = basis.left_vectors.rowwise() - prior.mean.transpose();
  const Eigen::MatrixXd& information = equations.information;
  // With C = V^T W V / mass:  A^T (R + A C A^T)^-1 A = (1 + I C)^-1 I, I = A^T R^-1 A.
  const Eigen::MatrixXd covariance = v.transpose() * prior.weight.asDiagonal() * v / prior.mass;
  Eigen::MatrixXd system = information * covariance;
  system.diagonal().array() += 1.0;
  const Eigen::MatrixXd explained = system.partialPivLu().solve(information);
  std::vector<double> chi2;
  for (const std::vector<Eigen::Index>& rows : groups) {
    const Eigen::MatrixXd own = v(rows, Eigen::all);
    const Eigen::VectorXd weight = prior.weight(rows);
    // The mean of the others lies on the other side: a large group must not hide behind it.
    const Eigen::RowVectorXd shift =
        weight.transpose() * own / std::max(prior.mass - weight.sum(), 1e-9 * prior.mass);
    const Eigen::MatrixXd apart = own.rowwise() + shift;
    // Taking the group's rows out of C is a low-rank change (Woodbury).
    Eigen::MatrixXd rest = -own * explained * own.transpose() / prior.mass;
    rest.diagonal() += weight.cwiseInverse();
    const Eigen::MatrixXd across = apart * explained * own.transpose();
    const Eigen::MatrixXd added =
        across * rest.partialPivLu().solve(across.transpose()) / prior.mass;
    const double sum = (apart * explained).cwiseProduct(apart).sum() + added.trace();
    chi2.push_back(std::max(sum, 0.0) / static_cast<double>(rows.size()));
  }
  return chi2;
}

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
  if (groups.size() < kFewestGroups) return prior;
  for (int round = 0; round < kRounds; ++round) {
    const std::vector<double> chi2 = left_out_chi2(basis, equations, prior, groups);
    const double usual = kUsual * median(chi2);
    if (!(usual > 0.0 && std::isfinite(usual))) return uniform_prior(basis);
    Eigen::VectorXd weight(basis.row_count());
    for (std::size_t group = 0; group < groups.size(); ++group) {
      weight(groups[group]).setConstant(chi2[group] > usual ? usual / chi2[group] : 1.0);
    }
    prior = with_weights(basis, std::move(weight));
  }
  return prior;
}

}  // namespace gonio::basis::detail
