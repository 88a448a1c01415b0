#include "left_out.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "gonio/basis/siblings.h"

namespace gonio::basis::detail {
namespace {

/// R^-1 of some columns (n x anything), pose by pose as in normal_equations().
Eigen::MatrixXd whitened(const SampleRows& rows, const MappedSamples& mapped,
                         const Eigen::MatrixXd& columns) {
  const Eigen::VectorXd precision = mapped.variance.cwiseInverse();
  Eigen::MatrixXd result = precision.asDiagonal() * columns;
  for (const auto& members : rows.poses) {
    const Eigen::MatrixXd common = mapped.common(members, Eigen::all);
    if ((common.array() == 0.0).all()) continue;
    const Eigen::MatrixXd weighted = precision(members).asDiagonal() * common;
    const Eigen::LLT<Eigen::MatrixXd> small(
        Eigen::MatrixXd::Identity(common.cols(), common.cols()) + common.transpose() * weighted);
    result(members, Eigen::all) -=
        weighted * small.solve(weighted.transpose() * columns(members, Eigen::all));
  }
  return result;
}

/// How the mapped samples move when the whole BRDF is scaled: d ln(f w + eps) / d ln f.
Eigen::VectorXd scale_slopes(const LogMapping& mapping, const MappedSamples& mapped) {
  return (1.0 - mapping.epsilon * (-mapped.x.array()).exp()).max(0.0).matrix();
}

/// x^T (R + A A^T/m)^-1 z from the same with R^-1 alone.
double with_prior(double product, const Eigen::VectorXd& right_x, const Eigen::VectorXd& right_z,
                  const Eigen::LLT<Eigen::MatrixXd>& posterior) {
  return product - right_x.dot(posterior.solve(right_z));
}

Eigen::LLT<Eigen::MatrixXd> posterior_of(const NormalEquations& equations, double m) {
  Eigen::MatrixXd normal = equations.information;
  normal.diagonal().array() += m;
  return normal.llt();
}

/// The part of MappedSamples::variance that is noise.
Eigen::VectorXd own_variance(const MappedSamples& mapped, double model_variance) {
  return (mapped.variance.array() - model_variance).max(0.0);
}

/// z^T N z with the covariance N of the stated noise.
double noise_along(const SampleRows& rows, const MappedSamples& mapped, double model_variance,
                   const Eigen::VectorXd& z) {
  double sum = own_variance(mapped, model_variance).dot(z.cwiseAbs2());
  for (const auto& members : rows.poses) {
    sum += (mapped.common(members, Eigen::all).transpose() * z(members)).squaredNorm();
  }
  return sum;
}

/// Offset with a prior of standard deviation 1 taken out of a chi^2.
double without_scale(double chi2, double product, double square) {
  return std::max(chi2 - product * product / (1.0 + square), 0.0);
}

}  // namespace

NoisePropagation propagate_noise(const SampleRows& rows, const MappedSamples& mapped,
                                 double model_variance) {
  const Eigen::VectorXd own = own_variance(mapped, model_variance);
  const Eigen::MatrixXd precise = whitened(rows, mapped, rows.a);
  NoisePropagation noise;
  noise.right_covariance = precise.transpose() * own.asDiagonal() * precise;
  for (const auto& members : rows.poses) {
    const Eigen::MatrixXd common = mapped.common(members, Eigen::all);
    if ((common.array() == 0.0).all()) continue;
    const Eigen::MatrixXd moved = precise(members, Eigen::all).transpose() * common;
    noise.right_covariance += moved * moved.transpose();
  }
  // (R^-1)_ii and (R^-1 V V^T)_ii pose by pose, both from R^-1 V.
  const Eigen::VectorXd explained =
      whitened(rows, mapped, mapped.common).cwiseProduct(mapped.common).rowwise().sum();
  const Eigen::VectorXd precision =
      (1.0 - explained.array()).max(0.0).matrix().cwiseQuotient(mapped.variance);
  noise.innovation = own.dot(precision) + explained.sum();

  const Eigen::VectorXd common = mapped.common.rowwise().squaredNorm();
  const Eigen::VectorXd total = mapped.variance + common;
  noise.mean_square = (own + common).cwiseQuotient(total).sum() / total.cwiseInverse().sum();
  return noise;
}

void compare_with_training(const Basis& basis, const std::array<SeenChannel, 3>& channels,
                           double model_variance, Fit& fit) {
  const Eigen::MatrixXd& u = basis.left_vectors;
  const Eigen::Index m = u.rows();
  const double prior = static_cast<double>(m);
  const double values = 3.0 * static_cast<double>(channels[0].rows.mean.size());
  Likeness& likeness = fit.likeness;
  likeness.distance.resize(m, 3);

  double chi2 = 0.0;
  double product = 0.0;
  double square = 0.0;
  double innovation_noise = 0.0;
  double residual_noise = 0.0;
  double scale_noise = 0.0;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const auto& [rows, mapped, equations] = channels[c];
    const Eigen::LLT<Eigen::MatrixXd> posterior = posterior_of(equations, prior);
    const NoisePropagation noise = propagate_noise(rows, mapped, model_variance);
    const Eigen::MatrixXd half = posterior.solve(noise.right_covariance);
    fit.noise_covariance[c] = posterior.solve(half.transpose());
    // With S = R + A A^T/m: tr(S^-1 N) of the samples, and tr(S^-1 R S^-1 N) of what the solve,
    // R S^-1 times the samples, leaves of them.
    innovation_noise += noise.innovation - half.trace();
    residual_noise += noise.innovation - 2.0 * half.trace() +
                      equations.information.cwiseProduct(fit.noise_covariance[c]).sum();

    likeness.distance.col(static_cast<Eigen::Index>(c)) =
        (((u * equations.likeness).cwiseProduct(u).rowwise().sum() -
          2.0 * u * equations.likeness_right)
             .array() +
         (equations.likeness_square - noise.mean_square))
            .max(0.0);

    const Eigen::VectorXd scale = scale_slopes(basis.mapping, mapped);
    const Eigen::VectorXd precise = whitened(rows, mapped, scale);
    const Eigen::VectorXd right_scale = rows.a.transpose() * precise;
    chi2 += with_prior(equations.square, equations.right, equations.right, posterior);
    product +=
        with_prior(precise.dot(mapped.x - rows.mean), right_scale, equations.right, posterior);
    square += with_prior(precise.dot(scale), right_scale, right_scale, posterior);
    const Eigen::VectorXd against_scale =
        precise - whitened(rows, mapped, rows.a * posterior.solve(right_scale));
    scale_noise += noise_along(rows, mapped, model_variance, against_scale);
    if (c != 1) continue;

    // The training materials by the green channel's noise, each without its group's rows: removing
    // them from the prior's covariance is a change of as many ranks.
    const Eigen::MatrixXd seen = u * (equations.likeness * u.transpose());
    likeness.row_distance = -2.0 * seen;
    likeness.row_distance.colwise() += seen.diagonal();
    likeness.row_distance.rowwise() += seen.diagonal().transpose();
    likeness.row_distance = likeness.row_distance.cwiseMax(0.0);

    const Eigen::MatrixXd h = prior * u * (posterior.solve(equations.information) * u.transpose());
    const Eigen::VectorXd b = prior * u * posterior.solve(right_scale);
    const double s = with_prior(precise.dot(scale), right_scale, right_scale, posterior);
    likeness.left_out_innovation.resize(m / 3);
    likeness.left_out_chi2.resize(m / 3);
    const Eigen::VectorXd left = (fit.left_out_residuals * equations.information)
                                     .cwiseProduct(fit.left_out_residuals)
                                     .rowwise()
                                     .sum();
    for (const std::vector<Eigen::Index>& group : rows_of_groups(basis)) {
      const Eigen::MatrixXd own = h(group, group);
      const Eigen::VectorXd own_b = b(group);
      Eigen::MatrixXd rest = -own;
      rest.diagonal().array() += prior;
      const Eigen::LDLT<Eigen::MatrixXd> solver(rest);
      const Eigen::VectorXd own_chi2 = prior * solver.solve(own).diagonal();
      const Eigen::VectorXd moved = solver.solve(own_b);
      const double own_square = 3.0 * (s + own_b.dot(moved));
      for (std::size_t i = 0; i < group.size(); i += 3) {
        const Eigen::Index material = group[i] / 3;
        const auto at = static_cast<Eigen::Index>(i);
        likeness.left_out_chi2[material] = left.segment<3>(3 * material).sum() / values;
        likeness.left_out_innovation[material] =
            without_scale(own_chi2.segment<3>(at).sum(), prior * moved.segment<3>(at).sum(),
                          own_square) /
            values;
      }
    }
  }
  likeness.innovation = without_scale(chi2, product, square) / values;
  likeness.left_out_innovation.array() +=
      std::max(innovation_noise - scale_noise / (1.0 + square), 0.0) / values;
  likeness.left_out_chi2.array() += std::max(residual_noise, 0.0) / values;
}

}  // namespace gonio::basis::detail
