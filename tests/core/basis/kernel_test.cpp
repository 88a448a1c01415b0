#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "gonio/basis/dense_field.h"
#include "gonio/basis/reconstruct.h"
#include "gonio/basis/siblings.h"
#include "gonio/parallel/parallel.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

using test::kRouteTolerance;

/// The kernel of Method::kernel: amplitude, and length in nepers.
constexpr double kAmplitude = 3.0;
constexpr double kLength = 0.7;

/// Values every training row would have at the samples, less their mean: n x m.
Eigen::MatrixXd training_values(const Basis& basis, const samples::SampleSet& set) {
  const BasisRows rows(basis);
  Eigen::MatrixXd values(static_cast<Eigen::Index>(set.samples.size()), basis.row_count());
  for (Eigen::Index i = 0; i < values.rows(); ++i) {
    const BasisRow row = rows.at(set.samples[static_cast<std::size_t>(i)].direction);
    values.row(i) = (basis.left_vectors * row.q).transpose();
  }
  return values;
}

Eigen::VectorXd measured_values(const Basis& basis, const samples::SampleSet& set, int channel) {
  const BasisRows rows(basis);
  Eigen::VectorXd values(static_cast<Eigen::Index>(set.samples.size()));
  for (Eigen::Index i = 0; i < values.size(); ++i) {
    const samples::Sample& sample = set.samples[static_cast<std::size_t>(i)];
    const BasisRow row = rows.at(sample.direction);
    values[i] = basis.mapping.forward(sample.value_per_sr[channel], row.weight) - row.mean;
  }
  return values;
}

double kernel(const Eigen::VectorXd& a, const Eigen::VectorXd& b, double variance, double m) {
  const double mean_square = (a - b).squaredNorm() / static_cast<double>(a.size());
  return a.dot(b) / (variance * m) + kAmplitude / (1.0 + mean_square / (kLength * kLength));
}

ReconstructOptions with(Method method) {
  ReconstructOptions options;
  options.method = method;
  return options;
}

/// K + 1 of all training rows.
Eigen::MatrixXd system_of(const Eigen::MatrixXd& training, double variance) {
  const Eigen::Index m = training.cols();
  Eigen::MatrixXd system(m, m);
  for (Eigen::Index i = 0; i < m; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      system(i, j) = kernel(training.col(i), training.col(j), variance, static_cast<double>(m)) +
                     (i == j ? 1.0 : 0.0);
    }
  }
  return system;
}

/// The same regression on the other rows, asked for the ones of a group.
void expect_left_out(const Basis& basis, const Eigen::MatrixXd& system, const Fit& found,
                     const std::vector<Eigen::Index>& group) {
  std::vector<Eigen::Index> others;
  for (Eigen::Index i = 0; i < system.rows(); ++i) {
    if (std::find(group.begin(), group.end(), i) == group.end()) others.push_back(i);
  }
  const Eigen::PartialPivLU<Eigen::MatrixXd> rest(Eigen::MatrixXd(system(others, others)));
  for (const Eigen::Index row : group) {
    const Eigen::VectorXd likeness = system(others, row);
    const Eigen::VectorXd left =
        basis.left_vectors.row(row).transpose() -
        basis.left_vectors(others, Eigen::all).transpose() * rest.solve(likeness);
    EXPECT_LT((found.left_out_residuals.row(row).transpose() - left).norm(),
              kRouteTolerance * basis.left_vectors.row(row).norm());
  }
}

TEST(Kernel, IsKernelRidgeOverTheTrainingRowsWrittenOut) {
  const Basis& basis = test::full_basis();
  const samples::SampleSet set = test::sample(test::material(40), test::six_directions());
  const Fit found = fit(basis, set, with(Method::kernel));

  const Eigen::MatrixXd training = training_values(basis, set);
  const Eigen::Index m = training.cols();
  const double variance = ReconstructOptions().model_eta / static_cast<double>(m);
  const Eigen::MatrixXd system = system_of(training, variance);
  for (int channel = 0; channel < 3; ++channel) {
    const Eigen::VectorXd y = measured_values(basis, set, channel);
    Eigen::VectorXd likeness(m);
    for (Eigen::Index i = 0; i < m; ++i) {
      likeness[i] = kernel(training.col(i), y, variance, static_cast<double>(m));
    }
    const Eigen::VectorXd expected =
        basis.left_vectors.transpose() * system.partialPivLu().solve(likeness);
    EXPECT_LT((found.coefficients.col(channel) - expected).norm(),
              kRouteTolerance * expected.norm());
  }
  for (Eigen::Index row = 0; row < m; row += 3) {
    expect_left_out(basis, system, found, {row, row + 1, row + 2});
  }
}

TEST(Kernel, LeavesSiblingsOutTogether) {
  Basis basis = test::full_basis();
  basis.materials[1].group = "twins";
  basis.materials[4].group = "twins";
  EXPECT_EQ(sibling_groups(basis.materials), (std::vector<std::size_t>{0, 1, 2, 3, 1, 4}));
  EXPECT_EQ(count_groups(basis.materials), 5u);
  const samples::SampleSet set = test::sample(test::material(40), test::six_directions());
  const Fit found = fit(basis, set, with(Method::kernel));
  const Eigen::MatrixXd training = training_values(basis, set);
  const Eigen::MatrixXd system =
      system_of(training, ReconstructOptions().model_eta / static_cast<double>(basis.row_count()));
  expect_left_out(basis, system, found, {3, 4, 5, 12, 13, 14});
  expect_left_out(basis, system, found, {6, 7, 8});
  // What the verdict compares with knows less of a twin, and the same of the others.
  const Fit apart = fit(test::full_basis(), set, with(Method::kernel));
  EXPECT_GT(found.likeness.left_out_innovation[4], 1.01 * apart.likeness.left_out_innovation[4]);
  EXPECT_NEAR(found.likeness.left_out_innovation[2], apart.likeness.left_out_innovation[2],
              1e-6 * apart.likeness.left_out_innovation[2]);
}

TEST(Kernel, CountsTheNoiseSharedByAPose) {
  // Nine equal sub-samples whose error is all common say no more than one of them.
  const Basis& basis = test::full_basis();
  const auto measured = [&](int copies) {
    samples::SampleSet set = test::sample(test::material(40), test::six_directions());
    for (samples::Sample& sample : set.samples) sample.sigma_per_sr = 0.01 * sample.value_per_sr;
    samples::Sample repeated = set.samples[1];
    set.samples.erase(set.samples.begin() + 1);
    repeated.u_common_per_sr = 0.3 * repeated.value_per_sr;
    repeated.pose = 1;
    for (int i = 0; i < copies; ++i) set.samples.push_back(repeated);
    ReconstructOptions options = with(Method::kernel);
    options.model_eta = 1e-3;
    return fit(basis, set, options).coefficients;
  };
  const Eigen::MatrixXd one = measured(1);
  EXPECT_LT((measured(9) - one).norm(), 0.02 * one.norm());
}

TEST(Evidence, WeighsCandidatesBetweenRidgeAndKernel) {
  const Basis& basis = test::full_basis();
  const samples::SampleSet set = test::sample(test::material(40), test::six_directions());
  const Fit found = fit(basis, set, with(Method::automatic));
  EXPECT_GT(found.kernel_share, 0.0);
  EXPECT_LT(found.kernel_share, 1.0);
  EXPECT_EQ(found.left_out_residuals.rows(), basis.row_count());
  EXPECT_EQ(fit(basis, set, with(Method::ridge)).left_out_residuals.size(), 0);
}

TEST(Evidence, GivesTheSameBytesWithOneAndTwoThreads) {
  const samples::SampleSet set = test::sample(test::material(40), test::six_directions());
  parallel::set_thread_count(1);
  const Fit one = fit(test::full_basis(), set);
  parallel::set_thread_count(2);
  const Fit two = fit(test::full_basis(), set);
  parallel::set_thread_count(0);
  EXPECT_EQ(one.coefficients, two.coefficients);
  EXPECT_EQ(one.left_out_residuals, two.left_out_residuals);
}

TEST(Evidence, ReturnsATrainingMaterialWhenItsOwnSamplesAreMeasured) {
  // Many clean samples leave no doubt, whatever the weights.
  std::vector<brdf::HalfDiff> many;
  for (int i = 0; i < 200; ++i)
    many.push_back(test::bin_centre(i % 80, (7 * i) % 60, (11 * i) % 180));
  samples::SampleSet set;
  set.scale = brdf::RadiometricScale::si;
  for (const brdf::HalfDiff& at : many) {
    if (!brdf::above_horizon(at.theta_h, at.theta_d, at.phi_d)) continue;
    set.samples.push_back(test::sample(test::material(2), {at}).samples[0]);
  }
  const Fit found = fit(test::full_basis(), set);
  // Compared as fields: a coefficient counts by how much it changes.
  const Eigen::VectorXd spectrum =
      test::full_basis().singular_values.head(test::full_basis().component_count());
  for (int channel = 0; channel < 3; ++channel) {
    const Eigen::VectorXd truth = test::full_basis().left_vectors.row(6 + channel).transpose();
    const Eigen::VectorXd error = found.coefficients.col(channel) - truth;
    EXPECT_LT(spectrum.cwiseProduct(error).norm(), 0.05 * spectrum.cwiseProduct(truth).norm());
  }
}

}  // namespace
}  // namespace gonio::basis
