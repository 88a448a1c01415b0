#include "gonio/basis/reconstruct.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "gonio/errors/errors.h"
#include "kernel_evidence.h"
#include "left_out.h"
#include "noise_model.h"
#include "normal_equations.h"

namespace gonio::basis {
namespace {

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

Eigen::VectorXd ridge(const detail::NormalEquations& equations, double m) {
  Eigen::MatrixXd normal = equations.information;
  normal.diagonal().array() += m;
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factor(normal);
  Eigen::VectorXd coefficients = factor.solve(equations.right);
  if (factor.info() != Eigen::Success || !coefficients.allFinite()) {
    throw NumericalError("reconstruct: the normal equations are singular");
  }
  return coefficients;
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

/// One channel, linear: mapped, solved and mapped again where the mapping depends on the fit.
struct ChannelFit {
  detail::MappedSamples mapped;
  detail::NormalEquations equations;
  Eigen::VectorXd coefficients;
  Eigen::VectorXd fitted;  ///< 1/sr at the samples
};

ChannelFit fit_linear(const Basis& basis, const detail::SampleRows& rows,
                      const samples::SampleSet& set, int channel,
                      const ReconstructOptions& options) {
  ChannelFit fit;
  fit.coefficients.setZero(rows.a.cols());
  for (int round = 0; round <= options.relinearisations; ++round) {
    fit.mapped =
        detail::map_samples(basis, rows, set, channel, options, fit.coefficients, fit.fitted);
    fit.equations = detail::normal_equations(rows, fit.mapped);
    fit.coefficients = ridge(fit.equations, static_cast<double>(basis.row_count()));
    fit.fitted = inverse_mapped(basis.mapping, rows.mean + rows.a * fit.coefficients, rows.weight);
    if (!fit.mapped.depends_on_fit) break;
  }
  return fit;
}

/// What the linear fit is replaced by: every candidate's solution, weighed by its evidence.
void fit_by_evidence(const Basis& basis, const detail::SampleRows& rows,
                     const samples::SampleSet& set, const ReconstructOptions& options,
                     std::array<ChannelFit, 3>& channels, Fit& fit) {
  const auto equations_at = [&](double model_eta) {
    ReconstructOptions trial = options;
    trial.model_eta = model_eta;
    std::array<detail::NormalEquations, 3> equations;
    for (int channel = 0; channel < 3; ++channel) {
      const ChannelFit& linear = channels[static_cast<std::size_t>(channel)];
      equations[static_cast<std::size_t>(channel)] =
          detail::normal_equations(rows, detail::map_samples(basis, rows, set, channel, trial,
                                                             linear.coefficients, linear.fitted));
    }
    return equations;
  };
  detail::Evidence evidence = options.method == Method::kernel
                                  ? detail::single_kernel(basis, equations_at(options.model_eta))
                                  : detail::weigh_kernels(basis, equations_at, options.model_eta);
  fit.left_out_residuals = std::move(evidence.left_out_residuals);
  const auto seen = [&](std::size_t channel) {
    return detail::SeenChannel{rows, channels[channel].mapped, channels[channel].equations};
  };
  const double model_eta = options.eta.value_or(options.model_eta);
  detail::compare_with_training(basis, {seen(0), seen(1), seen(2)},
                                detail::model_variance(basis, model_eta), fit);
  for (std::size_t channel = 0; channel < 3; ++channel) {
    ChannelFit& one = channels[channel];
    one.coefficients = evidence.coefficients.col(static_cast<Eigen::Index>(channel));
    one.fitted = inverse_mapped(basis.mapping, rows.mean + rows.a * one.coefficients, rows.weight);
  }
  fit.kernel_share = evidence.kernel_share;
}

}  // namespace

std::string_view to_string(Method method) {
  switch (method) {
    case Method::automatic:
      return "auto";
    case Method::ridge:
      return "ridge";
    case Method::kernel:
      return "kernel";
    case Method::nielsen:
      break;
  }
  return "nielsen";
}

Method method_from_string(std::string_view name) {
  for (const Method method : {Method::automatic, Method::ridge, Method::kernel, Method::nielsen}) {
    if (name == to_string(method)) return method;
  }
  throw std::invalid_argument("reconstruction method '" + std::string(name) +
                              "', expected auto, ridge, kernel or nielsen");
}

Fit fit(const Basis& basis, const samples::SampleSet& set, const ReconstructOptions& wanted) {
  check(basis, set, wanted);
  const bool published = wanted.method == Method::nielsen;
  const ReconstructOptions options = published ? as_published(wanted) : wanted;
  const Eigen::Index n = static_cast<Eigen::Index>(set.samples.size());
  const Eigen::Index used =
      published ? std::min(n, basis.components.cols()) : basis.components.cols();
  const detail::SampleRows rows = detail::look_up(BasisRows(basis), set, used);
  const double per_value = 1.0 / static_cast<double>(3 * n);

  Fit fit;
  fit.coefficients.setZero(basis.components.cols(), 3);
  fit.fitted_per_sr.resize(n, 3);
  fit.standardised.resize(n, 3);
  std::array<ChannelFit, 3> channels;
  for (int channel = 0; channel < 3; ++channel) {
    ChannelFit& one = channels[static_cast<std::size_t>(channel)];
    one = fit_linear(basis, rows, set, channel, options);
    // y^T (R + A A^T/m)^-1 y, by the matrix inversion lemma.
    fit.innovation_chi2_per_sample +=
        (one.equations.square - one.equations.right.dot(one.coefficients)) * per_value;
  }
  if (options.method == Method::kernel || options.method == Method::automatic) {
    fit_by_evidence(basis, rows, set, options, channels, fit);
  }
  for (int channel = 0; channel < 3; ++channel) {
    const ChannelFit& one = channels[static_cast<std::size_t>(channel)];
    const Eigen::VectorXd sigma =
        (one.mapped.variance + one.mapped.common.rowwise().squaredNorm()).cwiseSqrt();
    fit.coefficients.col(channel).head(used) = one.coefficients;
    fit.fitted_per_sr.col(channel) = one.fitted;
    fit.standardised.col(channel) =
        (one.mapped.x - rows.mean - rows.a * one.coefficients).cwiseQuotient(sigma);
    fit.chi2_per_sample += one.equations.chi2(one.coefficients) * per_value;
  }
  return fit;
}

}  // namespace gonio::basis
