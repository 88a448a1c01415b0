#include "gonio/basis/uncertainty.h"

#include <cblas.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

#include "cell_weights.h"
#include "gonio/basis/dense_field.h"
#include "gonio/basis/siblings.h"
#include "gonio/brdf/cell_weight.h"
#include "gonio/parallel/parallel.h"

namespace gonio::basis {
namespace {

namespace lattice = brdf::lattice;

constexpr std::size_t kUncertaintyBlock = 8192;
/// Every so-manieth cell is enough for quantiles over all training rows; prime, so that no axis of
/// the lattice is favoured.
constexpr Eigen::Index kStride = 397;
/// Nepers, root mean square over the samples: rows this far away count as a quarter.
constexpr double kNeighbourhood = 0.5;
/// Directions of error that hold less than this share of the square are spread over the others.
constexpr double kNegligible = 0.003;
/// Directions are chosen for the training materials, whose left-out errors are therefore smaller
/// than those of a new material. Measured on held-out MERL materials, folds of the design too:
/// limits without it hold 65 and 94 % and leave a quarter of the materials below 90 %.
constexpr double kDesignOptimism = 1.12;
/// Keeps a cell where every neighbour was right from being called certain (nepers).
constexpr double kLeastSigma = 0.003;

void check(const Basis& basis, const Fit& fit) {
  const Eigen::Index m = basis.row_count();
  const Eigen::Index k = basis.component_count();
  if (fit.left_out_residuals.rows() != m || fit.left_out_residuals.cols() != k ||
      fit.likeness.row_distance.rows() != m || fit.likeness.distance.rows() != m) {
    throw std::invalid_argument(
        "uncertainty: the fit holds no left-out residuals of this basis' materials; fit by auto or "
        "kernel");
  }
  if (count_groups(basis.materials) < kFewestGroupsForBands) {
    throw std::invalid_argument("uncertainty: a basis of fewer than 3 groups of materials");
  }
}

/// Weighted quantiles of positive values without keeping them: bins a hundredth wide.
class Quantiles {
 public:
  void add(double value, double weight) {
    const double at = (std::log(std::max(value, kLowest)) - std::log(kLowest)) / kWidth;
    bins_[std::min(static_cast<std::size_t>(at), bins_.size() - 1)] += weight;
  }
  double at(double share) const {
    double total = 0.0;
    for (const double bin : bins_) total += bin;
    double below = 0.0;
    for (std::size_t i = 0; i < bins_.size(); ++i) {
      below += bins_[i];
      if (below >= share * total) {
        return kLowest * std::exp((static_cast<double>(i) + 0.5) * kWidth);
      }
    }
    return kLowest;
  }

 private:
  static constexpr double kLowest = 0.01;
  static constexpr double kWidth = 0.01;
  std::vector<double> bins_ = std::vector<double>(1200, 0.0);
};

/// Left-out errors of the training rows over what their own neighbours' errors led to expect.
Quantiles standardised_errors(const Basis& basis, const Fit& fit) {
  const Eigen::MatrixXd& left = fit.left_out_residuals;
  const Eigen::Index m = left.rows();
  const Eigen::Index count = (basis.components.rows() + kStride - 1) / kStride;
  Eigen::MatrixXd rows(basis.components.cols(), count);
  std::vector<double> weights;
  for (Eigen::Index i = 0; i < count; ++i) {
    rows.col(i) = basis.components.row(i * kStride).transpose().cast<double>();
    const std::uint32_t cell =
        lattice::cells_above_horizon()[static_cast<std::size_t>(i * kStride)];
    weights.push_back(brdf::cell_weight(lattice::angles_of(lattice::index_from_cell(cell))));
  }
  Eigen::MatrixXd neighbours(m, m);
  for (const std::vector<Eigen::Index>& group : rows_of_groups(basis)) {
    for (const Eigen::Index t : group) {
      Eigen::VectorXd distance = fit.likeness.row_distance.row(t).transpose();
      distance(group).setConstant(-1.0);
      neighbours.row(t) = detail::likeness_weights(distance).transpose();
    }
  }
  const Eigen::MatrixXd errors = left * rows;
  const Eigen::MatrixXd expected = neighbours * errors.array().square().matrix();
  Quantiles found;
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index t = 0; t < m; ++t) {
      found.add(std::abs(errors(t, i)) / std::sqrt(expected(t, i) + kLeastSigma * kLeastSigma),
                weights[static_cast<std::size_t>(i)]);
    }
  }
  return found;
}

/// F with F F^T near the covariance of a channel's coefficients, as few columns as will do.
Eigen::MatrixXd factor_of(const Basis& basis, const Fit& fit, Eigen::Index channel) {
  const Eigen::MatrixXd& left = fit.left_out_residuals;
  const Eigen::VectorXd weights = detail::likeness_weights(fit.likeness.distance.col(channel));
  const Eigen::ArrayXd lengths = basis.singular_values.head(left.cols()).array().max(1e-12);
  // In units where all components count alike, so that cutting off costs least.
  Eigen::MatrixXd covariance = left.transpose() * weights.asDiagonal() * left;
  covariance += fit.noise_covariance[static_cast<std::size_t>(channel)];
  covariance.array().colwise() *= lengths;
  covariance.array().rowwise() *= lengths.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(covariance);
  const Eigen::VectorXd values = solver.eigenvalues().cwiseMax(0.0);
  const double total = values.sum();
  Eigen::Index kept = 0;
  double sum = 0.0;
  while (kept < values.size() && sum < (1.0 - kNegligible) * total) {
    sum += values[values.size() - 1 - kept++];
  }
  kept = std::max<Eigen::Index>(kept, 1);
  Eigen::MatrixXd factor = solver.eigenvectors().rightCols(kept);
  factor.array().rowwise() *= values.tail(kept).array().sqrt().transpose();
  factor.array().colwise() /= lengths;
  return sum > 0.0 ? Eigen::MatrixXd(factor * std::sqrt(total / sum)) : factor;
}

}  // namespace

Eigen::VectorXd detail::likeness_weights(const Eigen::Ref<const Eigen::VectorXd>& distance) {
  constexpr double kSquare = kNeighbourhood * kNeighbourhood;
  // The scale follows the nearest rows: something far from all is judged by the least far.
  double nearest = std::numeric_limits<double>::infinity();
  for (const double each : distance) {
    if (each >= 0.0) nearest = std::min(nearest, each);
  }
  Eigen::VectorXd weights =
      (1.0 + distance.array().max(0.0) / (kSquare + nearest)).square().inverse();
  weights = (distance.array() < 0.0).select(0.0, weights);
  return weights / weights.sum();
}

Uncertainty uncertainty(const Basis& basis, const Fit& fit) {
  check(basis, fit);
  Uncertainty found;
  const Quantiles quantiles = standardised_errors(basis, fit);
  found.factor_68 = kDesignOptimism * quantiles.at(0.68);
  found.factor_95 = kDesignOptimism * quantiles.at(0.95);

  std::array<Eigen::Index, 4> first{};
  std::array<RowMajorMatrixXf, 3> factors;
  for (Eigen::Index c = 0; c < 3; ++c) {
    factors[static_cast<std::size_t>(c)] = factor_of(basis, fit, c).cast<float>();
    first[static_cast<std::size_t>(c + 1)] =
        first[static_cast<std::size_t>(c)] + factors[static_cast<std::size_t>(c)].cols();
  }
  RowMajorMatrixXf all(basis.components.cols(), first[3]);
  for (std::size_t c = 0; c < 3; ++c) all.middleCols(first[c], factors[c].cols()) = factors[c];

  const Eigen::Index p = basis.components.rows();
  const int k = static_cast<int>(basis.components.cols());
  const int width = static_cast<int>(all.cols());
  constexpr float kFloor = static_cast<float>(kLeastSigma * kLeastSigma);
  found.sigma.resize(p, 3);
  parallel::for_each_block(
      0, static_cast<std::size_t>(p), kUncertaintyBlock, [&](std::size_t begin, std::size_t end) {
        const auto from = static_cast<Eigen::Index>(begin);
        const auto count = static_cast<Eigen::Index>(end - begin);
        RowMajorMatrixXf product(count, all.cols());
        cblas_sgemm(CblasRowMajor, CblasNoTrans, CblasNoTrans, static_cast<int>(count), width, k,
                    1.0F, basis.components.data() + from * k, k, all.data(), width, 0.0F,
                    product.data(), width);
        for (std::size_t c = 0; c < 3; ++c) {
          found.sigma.col(static_cast<Eigen::Index>(c)).segment(from, count) =
              (product.middleCols(first[c], factors[c].cols()).rowwise().squaredNorm().array() +
               kFloor)
                  .sqrt()
                  .matrix();
        }
      });
  return found;
}

brdf::BrdfTable limit(const Basis& basis, const Fit& fit, const Uncertainty& uncertainty,
                      double factor) {
  const Eigen::MatrixXf field = mapped_field(basis, fit.coefficients);
  if (uncertainty.sigma.rows() != field.rows() || uncertainty.sigma.cols() != 3) {
    throw std::invalid_argument("limit: the uncertainty is of another basis");
  }
  return table_of(basis, field + static_cast<float>(factor) * uncertainty.sigma);
}

}  // namespace gonio::basis
