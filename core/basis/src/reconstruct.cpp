#include "gonio/basis/reconstruct.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "gonio/errors/errors.h"
#include "noise_model.h"

namespace gonio::basis {
namespace {

constexpr double kPublishedEta = 40.0;

void check(const Basis& basis, const samples::SampleSet& set, const ReconstructOptions& options) {
  if (set.samples.empty()) throw std::invalid_argument("reconstruct: there are no samples");
  if (set.scale != basis.scale) {
    throw std::invalid_argument("reconstruct: samples in radiometric scale " +
                                std::string(to_string(set.scale)) + ", the basis in " +
                                std::string(to_string(basis.scale)));
  }
  const auto bad = [](double eta) { return !(std::isfinite(eta) && eta >= 0.0); };
  if ((options.eta && bad(*options.eta)) || bad(options.model_eta)) {
    throw std::invalid_argument("reconstruct: eta must be finite and not negative");
  }
  if (options.relinearisations < 0) {
    throw std::invalid_argument("reconstruct: fewer than 0 relinearisations asked for");
  }
  for (std::size_t i = 0; i < set.samples.size(); ++i) {
    const samples::Sample& sample = set.samples[i];
    const bool finite = sample.value_per_sr.isFinite().all() &&
                        sample.sigma_per_sr.isFinite().all() &&
                        sample.u_common_per_sr.isFinite().all();
    if (!finite || (sample.sigma_per_sr < 0.0).any() || (sample.u_common_per_sr < 0.0).any()) {
      throw std::invalid_argument("reconstruct: sample " + std::to_string(i + 1) +
                                  " has a value or sigma that is not finite, or a negative sigma");
    }
  }
}

struct Solution {
  Eigen::VectorXd coefficients;
  double chi2 = 0.0;             ///< r^T R^-1 r
  double innovation_chi2 = 0.0;  ///< y^T (R + A A^T/m)^-1 y
};

/// Minimises (y - A c)^T R^-1 (y - A c) + m c^T c. A pose's block of R is diagonal plus at most
/// four columns, so that its inverse costs as much as a diagonal one (Woodbury).
Solution solve(const detail::SampleRows& rows, const detail::MappedSamples& mapped, double m) {
  const Eigen::VectorXd precision_root = mapped.variance.cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd a = precision_root.asDiagonal() * rows.a;
  const Eigen::VectorXd y = precision_root.cwiseProduct(mapped.x - rows.mean);
  const Eigen::MatrixXd v = precision_root.asDiagonal() * mapped.common;

  const Eigen::Index k = a.cols();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(k, k);
  normal.diagonal().setConstant(m);
  normal.selfadjointView<Eigen::Lower>().rankUpdate(a.transpose());
  Eigen::VectorXd right = a.transpose() * y;
  double square = y.squaredNorm();  // becomes y^T R^-1 y

  std::vector<Eigen::MatrixXd> projected_a;  // L^-1 V^T A per pose, L L^T = 1 + V^T V
  std::vector<Eigen::VectorXd> projected_y;
  for (const auto& members : rows.poses) {
    const Eigen::MatrixXd v_pose = v(members, Eigen::all);
    if ((v_pose.array() == 0.0).all()) continue;
    const Eigen::LLT<Eigen::MatrixXd> small(Eigen::MatrixXd::Identity(v.cols(), v.cols()) +
                                            v_pose.transpose() * v_pose);
    projected_a.push_back(small.matrixL().solve(v_pose.transpose() * a(members, Eigen::all)));
    projected_y.push_back(small.matrixL().solve(v_pose.transpose() * y(members)));
    normal.selfadjointView<Eigen::Lower>().rankUpdate(projected_a.back().transpose(), -1.0);
    right -= projected_a.back().transpose() * projected_y.back();
    square -= projected_y.back().squaredNorm();
  }

  const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factor(normal);
  Solution solution;
  solution.coefficients = factor.solve(right);
  if (factor.info() != Eigen::Success || !solution.coefficients.allFinite()) {
    throw NumericalError("reconstruct: the normal equations are singular");
  }
  solution.chi2 = (y - a * solution.coefficients).squaredNorm();
  for (std::size_t i = 0; i < projected_a.size(); ++i) {
    solution.chi2 -= (projected_y[i] - projected_a[i] * solution.coefficients).squaredNorm();
  }
  solution.innovation_chi2 = square - right.dot(solution.coefficients);
  return solution;
}

Eigen::VectorXd inverse_mapped(const LogMapping& mapping, const Eigen::VectorXd& x,
                               const Eigen::VectorXd& weight) {
  Eigen::VectorXd f(x.size());
  for (Eigen::Index i = 0; i < x.size(); ++i) f[i] = mapping.inverse(x[i], weight[i]);
  return f;
}

/// As released by the authors: the first min(n, k) components, one eta, one solve.
ReconstructOptions as_published(ReconstructOptions options) {
  options.eta = options.eta.value_or(kPublishedEta);
  options.relinearisations = 0;
  return options;
}

}  // namespace

std::string_view to_string(Method method) { return method == Method::ridge ? "ridge" : "nielsen"; }

Method method_from_string(std::string_view name) {
  if (name == "ridge") return Method::ridge;
  if (name == "nielsen") return Method::nielsen;
  throw std::invalid_argument("reconstruction method '" + std::string(name) +
                              "', expected ridge or nielsen");
}

Fit fit(const Basis& basis, const samples::SampleSet& set, const ReconstructOptions& wanted) {
  check(basis, set, wanted);
  const bool published = wanted.method == Method::nielsen;
  const ReconstructOptions options = published ? as_published(wanted) : wanted;
  const Eigen::Index n = static_cast<Eigen::Index>(set.samples.size());
  const Eigen::Index used =
      published ? std::min(n, basis.components.cols()) : basis.components.cols();
  const detail::SampleRows rows = detail::look_up(BasisRows(basis), set, used);

  Fit fit;
  fit.coefficients.setZero(basis.components.cols(), 3);
  fit.fitted_per_sr.resize(n, 3);
  fit.standardised.resize(n, 3);
  for (int channel = 0; channel < 3; ++channel) {
    Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(used);
    Eigen::VectorXd fitted;
    detail::MappedSamples mapped;
    Solution solution;
    for (int round = 0; round <= options.relinearisations; ++round) {
      mapped = detail::map_samples(basis, rows, set, channel, options, coefficients, fitted);
      solution = solve(rows, mapped, static_cast<double>(basis.row_count()));
      coefficients = solution.coefficients;
      fitted = inverse_mapped(basis.mapping, rows.mean + rows.a * coefficients, rows.weight);
      if (!mapped.depends_on_fit) break;
    }
    const Eigen::VectorXd sigma =
        (mapped.variance + mapped.common.rowwise().squaredNorm()).cwiseSqrt();
    fit.coefficients.col(channel).head(used) = coefficients;
    fit.fitted_per_sr.col(channel) = fitted;
    fit.standardised.col(channel) =
        (mapped.x - rows.mean - rows.a * coefficients).cwiseQuotient(sigma);
    fit.chi2_per_sample += solution.chi2 / static_cast<double>(3 * n);
    fit.innovation_chi2_per_sample += solution.innovation_chi2 / static_cast<double>(3 * n);
  }
  return fit;
}

}  // namespace gonio::basis
