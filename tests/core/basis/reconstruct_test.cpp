#include "gonio/basis/reconstruct.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

#include "directions_deg.h"
#include "gonio/errors/errors.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

using ::testing::HasSubstr;

const std::vector<brdf::HalfDiff>& ten_directions() {
  static const std::vector<brdf::HalfDiff> directions = {
      half_diff_deg(3, 12, 28),  half_diff_deg(63, 19, 89), half_diff_deg(5, 77, 77),
      half_diff_deg(2, 60, 170), half_diff_deg(15, 4, 130), half_diff_deg(1, 6, 37),
      half_diff_deg(2, 79, 110), half_diff_deg(39, 76, 89), half_diff_deg(0.3, 71, 104),
      half_diff_deg(5, 75, 160)};
  return directions;
}

/// A and mu of samples, row by row from the public look-up.
struct Rows {
  Eigen::MatrixXd a;
  Eigen::VectorXd mean, weight;

  Rows(const Basis& basis, const samples::SampleSet& set) {
    const Eigen::Index n = static_cast<Eigen::Index>(set.samples.size());
    a.resize(n, basis.component_count());
    mean.resize(n);
    weight.resize(n);
    const BasisRows rows(basis);
    for (Eigen::Index i = 0; i < n; ++i) {
      const BasisRow row = rows.at(set.samples[static_cast<std::size_t>(i)].direction);
      a.row(i) = row.q.transpose();
      mean[i] = row.mean;
      weight[i] = row.weight;
    }
  }
  Eigen::VectorXd mapped(const LogMapping& mapping, const samples::SampleSet& set,
                         int channel) const {
    Eigen::VectorXd x(mean.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      x[i] = mapping.forward(set.samples[static_cast<std::size_t>(i)].value_per_sr[channel],
                             weight[i]);
    }
    return x;
  }
};

using test::kRouteTolerance;

TEST(Reconstruct, RidgeEqualsItsKernelForm) {
  const Basis& basis = test::full_basis();
  const samples::SampleSet set = test::sample(test::material(40), ten_directions());
  ReconstructOptions options;
  options.method = Method::ridge;
  options.eta = 3.0;
  const Fit found = fit(basis, set, options);

  const Rows rows(basis, set);
  const Eigen::MatrixXd kernel =
      rows.a * rows.a.transpose() + 3.0 * Eigen::MatrixXd::Identity(10, 10);
  for (int channel = 0; channel < 3; ++channel) {
    const Eigen::VectorXd y = rows.mapped(basis.mapping, set, channel) - rows.mean;
    const Eigen::VectorXd dual = rows.a.transpose() * kernel.partialPivLu().solve(y);
    EXPECT_LT((found.coefficients.col(channel) - dual).norm(), kRouteTolerance * dual.norm());
  }
}

/// Samples in poses of three, each with independent and common noise and a few on their own.
samples::SampleSet samples_of_poses() {
  samples::SampleSet set = test::sample(test::material(41), ten_directions());
  for (std::size_t i = 0; i < set.samples.size(); ++i) {
    samples::Sample& sample = set.samples[i];
    sample.pose = i < 9 ? static_cast<int>(i / 3) : -1;
    sample.sigma_per_sr = (0.01 + 0.002 * static_cast<double>(i)) * sample.value_per_sr;
    sample.u_common_per_sr = 0.05 * sample.value_per_sr;
  }
  return set;
}

TEST(Reconstruct, IsThePosteriorMeanUnderCommonPoseNoise) {
  // Conditioning of the joint Gaussian of c and x, with the full covariance written out.
  const Basis& basis = test::full_basis();
  const samples::SampleSet set = samples_of_poses();
  ReconstructOptions options;
  options.method = Method::ridge;
  options.model_eta = 0.7;
  const Fit found = fit(basis, set, options);

  const Rows rows(basis, set);
  const double m = basis.row_count();
  double chi2 = 0.0;
  double innovation = 0.0;
  for (int channel = 0; channel < 3; ++channel) {
    Eigen::MatrixXd r = Eigen::MatrixXd::Zero(10, 10);
    const auto slope = [&](Eigen::Index i) {
      const double f = set.samples[static_cast<std::size_t>(i)].value_per_sr[channel];
      return rows.weight[i] / (f * rows.weight[i] + basis.mapping.epsilon);
    };
    for (Eigen::Index i = 0; i < 10; ++i) {
      const samples::Sample& a = set.samples[static_cast<std::size_t>(i)];
      r(i, i) = std::pow(slope(i) * a.sigma_per_sr[channel], 2) + 0.7 / m;
      for (Eigen::Index j = 0; j < 10; ++j) {
        const samples::Sample& b = set.samples[static_cast<std::size_t>(j)];
        if (i == j || (a.pose == b.pose && a.pose >= 0)) {
          r(i, j) += slope(i) * a.u_common_per_sr[channel] * slope(j) * b.u_common_per_sr[channel];
        }
      }
    }
    const Eigen::MatrixXd cov_x = rows.a * rows.a.transpose() / m + r;
    const Eigen::VectorXd y = rows.mapped(basis.mapping, set, channel) - rows.mean;
    const Eigen::VectorXd weights = cov_x.partialPivLu().solve(y);
    const Eigen::VectorXd expected = rows.a.transpose() * weights / m;
    EXPECT_LT((found.coefficients.col(channel) - expected).norm(),
              kRouteTolerance * expected.norm());
    const Eigen::VectorXd residual = y - rows.a * expected;
    chi2 += residual.dot(r.partialPivLu().solve(residual)) / 30.0;
    innovation += y.dot(weights) / 30.0;
    for (Eigen::Index i = 0; i < 10; ++i) {
      EXPECT_NEAR(found.standardised(i, channel), residual[i] / std::sqrt(r(i, i)), 1e-5);
    }
  }
  EXPECT_NEAR(found.chi2_per_sample, chi2, 1e-5 * chi2);
  EXPECT_NEAR(found.innovation_chi2_per_sample, innovation, 1e-5 * innovation);
}

TEST(Reconstruct, CommonNoiseMakesNineSubSamplesLittleBetterThanOne) {
  // All sub-samples of one pose carry the same +20 %: a solver that takes them as independent
  // follows them, one that knows trusts the prior.
  const Basis& basis = test::full_basis();
  const Fit truth = fit(basis, test::sample(test::material(2), ten_directions()));
  samples::SampleSet set;
  for (int i = 0; i < 9; ++i) {
    samples::SampleSet one = test::sample(test::material(2), {half_diff_deg(30 + i, 30, 90)});
    one.samples[0].value_per_sr *= 1.2;
    one.samples[0].u_common_per_sr = 0.2 * one.samples[0].value_per_sr;
    one.samples[0].pose = 7;
    set.samples.push_back(one.samples[0]);
  }
  samples::SampleSet independent = set;
  for (samples::Sample& sample : independent.samples) sample.pose = -1;
  const Rows rows(basis, set);
  const auto bias = [&](const samples::SampleSet& samples) {
    const Eigen::MatrixXd error = rows.a * (fit(basis, samples).coefficients - truth.coefficients);
    return std::abs(error.mean());
  };
  EXPECT_LT(bias(set), bias(independent));
}

TEST(Reconstruct, RecoversATrainingMaterialFromManyCleanSamples) {
  const Basis& basis = test::full_basis();
  std::vector<brdf::HalfDiff> directions;
  for (int h = 2; h < 80; h += 6) {
    for (int d = 5; d < 80; d += 15) directions.push_back(test::bin_centre(h, d, 90));
  }
  const samples::SampleSet set = test::sample(test::material(1), directions);
  ReconstructOptions options;
  options.model_eta = 1e-4;
  const Fit found = fit(basis, set, options);
  const Eigen::MatrixXf field = mapped_field(basis, found.coefficients);
  double square = 0.0;
  for (int channel = 0; channel < 3; ++channel) {
    const auto row = test::training_set().row(1, channel);
    square += (Eigen::Map<const Eigen::VectorXf>(row.data(), field.rows()) - field.col(channel))
                  .cast<double>()
                  .squaredNorm();
  }
  EXPECT_LT(std::sqrt(square / static_cast<double>(field.size())), 0.01);
  EXPECT_LT((found.fitted_per_sr.row(0) - set.samples[0].value_per_sr.matrix().transpose()).norm(),
            0.01 * set.samples[0].value_per_sr.matrix().norm());
}

TEST(Reconstruct, InnovationIsLargeForAMaterialOutsideTheSpan) {
  const Basis& basis = test::full_basis();
  samples::SampleSet inside = test::sample(test::material(3), ten_directions());
  samples::SampleSet outside = inside;  // alternating factors that no lobe has
  for (std::size_t i = 0; i < outside.samples.size(); i += 2) {
    outside.samples[i].value_per_sr *= 30.0;
  }
  EXPECT_GT(fit(basis, outside).innovation_chi2_per_sample,
            10.0 * fit(basis, inside).innovation_chi2_per_sample);
}

TEST(Reconstruct, DoesNotDependOnTheOrderOfSamplesOrPoseNumbers) {
  const Basis& basis = test::full_basis();
  samples::SampleSet set = samples_of_poses();
  const Fit forward = fit(basis, set);
  std::reverse(set.samples.begin(), set.samples.end());
  for (samples::Sample& sample : set.samples) {
    if (sample.pose >= 0) sample.pose = 100 - sample.pose;
  }
  const Fit backward = fit(basis, set);
  EXPECT_LT((forward.coefficients - backward.coefficients).norm(),
            kRouteTolerance * forward.coefficients.norm());
}

template <typename Change>
std::string refusal_after(Change change) {
  samples::SampleSet set = test::sample(test::material(2), ten_directions());
  ReconstructOptions options;
  change(set, options);
  try {
    fit(test::full_basis(), set, options);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Reconstruct, RefusesWhatItCannotUse) {
  using Set = samples::SampleSet;
  using Options = ReconstructOptions;
  EXPECT_EQ(refusal_after([](Set&, Options&) {}), "accepted");
  EXPECT_THAT(refusal_after([](Set& set, Options&) { set.samples.clear(); }),
              HasSubstr("no samples"));
  EXPECT_THAT(refusal_after([](Set& set, Options&) { set.scale = brdf::RadiometricScale::merl; }),
              HasSubstr("scale merl"));
  EXPECT_THAT(refusal_after(
                  [](Set& set, Options&) { set.samples[3].direction = half_diff_deg(45, 60, 0); }),
              HasSubstr("sample 4"));
  EXPECT_THAT(refusal_after([](Set& set, Options&) {
                set.samples[1].value_per_sr[2] = std::numeric_limits<double>::infinity();
              }),
              HasSubstr("sample 2"));
  EXPECT_THAT(refusal_after([](Set& set, Options&) { set.samples[1].sigma_per_sr[0] = -0.1; }),
              HasSubstr("negative sigma"));
  EXPECT_THAT(refusal_after([](Set&, Options& options) { options.eta = -1.0; }), HasSubstr("eta"));
  EXPECT_THAT(refusal_after([](Set&, Options& options) { options.relinearisations = -1; }),
              HasSubstr("relinearisations"));
}

TEST(Reconstruct, KnowsItsMethodsByName) {
  EXPECT_EQ(method_from_string("auto"), Method::automatic);
  for (const Method method : {Method::automatic, Method::ridge, Method::kernel, Method::nielsen}) {
    EXPECT_EQ(method_from_string(to_string(method)), method);
  }
  EXPECT_THROW(method_from_string("magic"), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::basis
