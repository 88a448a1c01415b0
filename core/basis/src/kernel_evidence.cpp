#include "kernel_evidence.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "gonio/basis/siblings.h"
#include "gonio/parallel/parallel.h"
#include "kernel_solve.h"

namespace gonio::basis::detail {
namespace {

/// Nepers, root mean square over the samples: materials this far apart count as a quarter.
constexpr double kNeighbourhood = 0.7;
/// Candidates whose mean log square error is this much worse count 1/e: shallow, since the mean
/// over a hundred materials is itself known to about as much.
constexpr double kEvidenceScale = 0.1;
/// Below this share of the mean square of the training rows an error is as good as none.
constexpr double kErrorFloor = 1e-4;

constexpr KernelShape kUsualShape{3.0, 0.7};
constexpr std::array<double, 3> kAmplitudes = {0.0, 1.0, 3.0};
constexpr std::array<double, 2> kModelFactors = {0.3, 1.0};

/// How much each training material counts: by the mean square distance of its samples from the
/// measured ones, its nearest channel for each channel measured.
Eigen::VectorXd neighbour_weights(const Basis& basis, const ChannelEquations& equations,
                                  const std::vector<std::vector<Eigen::Index>>& groups) {
  const Eigen::MatrixXd& u = basis.left_vectors;
  const Eigen::Index materials = u.rows() / 3;
  Eigen::VectorXd distance = Eigen::VectorXd::Zero(materials);
  for (const NormalEquations& channel : equations) {
    const Eigen::VectorXd square =
        ((u * channel.likeness).cwiseProduct(u).rowwise().sum() - 2.0 * u * channel.likeness_right)
            .array() +
        channel.likeness_square;
    for (Eigen::Index material = 0; material < materials; ++material) {
      distance[material] += std::max(square.segment(3 * material, 3).minCoeff(), 0.0) / 3.0;
    }
  }
  constexpr double kSquare = kNeighbourhood * kNeighbourhood;
  Eigen::VectorXd weights = (1.0 + distance.array() / kSquare).square().inverse();
  // Siblings together count as one: a product in ten colours is no ten witnesses.
  for (const std::vector<Eigen::Index>& group : groups) {
    for (std::size_t i = 0; i < group.size(); i += 3) {
      weights[group[i] / 3] /= static_cast<double>(group.size() / 3);
    }
  }
  return weights / weights.sum();
}

/// Weighted mean over materials of the logarithm of the mean square error over cells and channels.
double mean_log_error(const Basis& basis, const Eigen::MatrixXd& residuals,
                      const Eigen::VectorXd& weights) {
  const Eigen::VectorXd spectrum =
      basis.singular_values.head(residuals.cols()).array().square().matrix();
  const Eigen::VectorXd square = residuals.array().square().matrix() * spectrum;
  const double floor = kErrorFloor * spectrum.sum() / static_cast<double>(residuals.rows());
  double sum = 0.0;
  for (Eigen::Index material = 0; material < weights.size(); ++material) {
    sum += weights[material] * std::log(square.segment(3 * material, 3).mean() + floor);
  }
  return sum;
}

struct Candidate {
  Evidence solution;
  double log_error = 0.0;
};

Candidate solve(const Basis& basis, const RowPrior& prior,
                const std::vector<std::vector<Eigen::Index>>& groups,
                const ChannelEquations& equations, const KernelShape& shape) {
  Candidate candidate;
  candidate.solution.coefficients.resize(basis.component_count(), 3);
  for (std::size_t channel = 0; channel < equations.size(); ++channel) {
    const KernelSolve kernel(basis, prior, equations[channel], shape);
    candidate.solution.coefficients.col(static_cast<Eigen::Index>(channel)) =
        kernel.coefficients(equations[channel]);
    // The noise of the channels differs little: one stands for all.
    if (channel == 1) candidate.solution.left_out_residuals = kernel.leave_out(groups);
  }
  candidate.solution.kernel_share = shape.amplitude > 0.0 ? 1.0 : 0.0;
  return candidate;
}

}  // namespace

Evidence single_kernel(const Basis& basis, const ChannelEquations& equations) {
  return solve(basis, uniform_prior(basis), rows_of_groups(basis), equations, kUsualShape).solution;
}

Evidence weigh_kernels(const Basis& basis,
                       const std::function<ChannelEquations(double model_eta)>& equations_at,
                       double model_eta) {
  std::array<ChannelEquations, kModelFactors.size()> equations;
  for (std::size_t i = 0; i < equations.size(); ++i) {
    equations[i] = equations_at(kModelFactors[i] * model_eta);
  }
  const RowPrior prior = heavy_tailed_prior(basis, equations.back()[1]);
  const std::vector<std::vector<Eigen::Index>> groups = rows_of_groups(basis);
  const Eigen::VectorXd neighbours = neighbour_weights(basis, equations.back(), groups);

  std::vector<Candidate> candidates(equations.size() * kAmplitudes.size());
  parallel::for_each_block(0, candidates.size(), 1, [&](std::size_t i, std::size_t) {
    const KernelShape shape{kAmplitudes[i % kAmplitudes.size()], kUsualShape.length};
    candidates[i] = solve(basis, prior, groups, equations[i / kAmplitudes.size()], shape);
    candidates[i].log_error =
        mean_log_error(basis, candidates[i].solution.left_out_residuals, neighbours);
  });

  double best = candidates.front().log_error;
  for (const Candidate& candidate : candidates) best = std::min(best, candidate.log_error);
  double total = 0.0;
  Evidence mean{Eigen::MatrixXd::Zero(basis.component_count(), 3),
                Eigen::MatrixXd::Zero(basis.row_count(), basis.component_count()), 0.0};
  for (const Candidate& candidate : candidates) {
    const double weight = std::exp((best - candidate.log_error) / kEvidenceScale);
    mean.coefficients += weight * candidate.solution.coefficients;
    mean.left_out_residuals += weight * candidate.solution.left_out_residuals;
    mean.kernel_share += weight * candidate.solution.kernel_share;
    total += weight;
  }
  mean.coefficients /= total;
  mean.left_out_residuals /= total;
  mean.kernel_share /= total;
  return mean;
}

}  // namespace gonio::basis::detail
