#include "gonio/basis/uncertainty.h"

#include <gtest/gtest.h>
#include <hdf5.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

#include "directions_deg.h"
#include "gonio/basis/dense_field.h"
#include "gonio/basis/uncertainty_file.h"
#include "gonio/errors/errors.h"
#include "gonio/parallel/parallel.h"
#include "temporary_folder.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

const std::string kSha(64, 'a');

samples::SampleSet measured(double relative_noise) {
  samples::SampleSet set = test::sample(test::material(40), test::six_directions());
  for (samples::Sample& sample : set.samples) {
    sample.sigma_per_sr = relative_noise * sample.value_per_sr;
  }
  return set;
}

const Fit& clean_fit() {
  static const Fit found = fit(test::full_basis(), measured(0.0));
  return found;
}

const Uncertainty& clean_uncertainty() {
  static const Uncertainty found = uncertainty(test::full_basis(), clean_fit());
  return found;
}

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(NoiseCovariance, IsWhatRepeatedNoisyMeasurementsScatterBy) {
  // Ridge is linear in the mapped values: moving one sample by a hundredth of its sigma moves the
  // coefficients by a hundredth of their share of the covariance.
  const Basis& basis = test::full_basis();
  ReconstructOptions ridge;
  ridge.method = Method::ridge;
  const samples::SampleSet base = measured(0.05);
  const Fit centre = fit(basis, base, ridge);
  Eigen::MatrixXd expected =
      Eigen::MatrixXd::Zero(basis.component_count(), basis.component_count());
  constexpr double kStep = 0.01;
  constexpr int kGreen = 1;
  for (std::size_t i = 0; i < base.samples.size(); ++i) {
    samples::SampleSet moved = base;
    moved.samples[i].value_per_sr += kStep * moved.samples[i].sigma_per_sr;
    const Eigen::VectorXd change =
        (fit(basis, moved, ridge).coefficients - centre.coefficients).col(kGreen) / kStep;
    expected += change * change.transpose();
  }
  const Eigen::MatrixXd found = fit(basis, base).noise_covariance[kGreen];
  // The mapping bends within a step, and the weights follow the sample's value.
  EXPECT_LT((found - expected).norm(), 0.02 * expected.norm());
}

TEST(NoiseCovariance, CountsNoiseSharedByAPoseOnce) {
  const Basis& basis = test::full_basis();
  const auto covariance = [&](bool one_pose) {
    samples::SampleSet set = measured(0.0);
    samples::Sample sample = set.samples.front();
    sample.u_common_per_sr = 0.1 * sample.value_per_sr;
    for (int i = 0; i < 9; ++i) {
      sample.pose = one_pose ? 100 : 100 + i;
      set.samples.push_back(sample);
    }
    return fit(basis, set).noise_covariance[0].trace();
  };
  EXPECT_GT(covariance(true), 3.0 * covariance(false));
}

TEST(Likeness, FindsTheMaterialThatWasMeasured) {
  const samples::SampleSet set = test::sample(test::material(3), test::six_directions());
  const Likeness likeness = fit(test::full_basis(), set).likeness;
  for (Eigen::Index channel = 0; channel < 3; ++channel) {
    Eigen::Index nearest = 0;
    // Bilinear rows against the exact model: a hundredth of a neper at a peak.
    EXPECT_LT(likeness.distance.col(channel).minCoeff(&nearest), 1e-3);
    EXPECT_EQ(nearest, 9 + channel);
  }
  EXPECT_LT(likeness.row_distance.diagonal().maxCoeff(), 1e-12);
}

TEST(Likeness, TakesAFactorCommonToAllChannelsOut) {
  const Basis& basis = test::full_basis();
  samples::SampleSet brighter = test::sample(test::material(2), test::six_directions());
  const double before = fit(basis, brighter).likeness.innovation;
  for (samples::Sample& sample : brighter.samples) sample.value_per_sr *= 2.0;
  const Fit scaled = fit(basis, brighter);
  EXPECT_LT(scaled.likeness.innovation, scaled.innovation_chi2_per_sample + 1e-9);
  EXPECT_GT(scaled.likeness.innovation, 0.0);
  EXPECT_LT(before, scaled.innovation_chi2_per_sample);
}

/// Samples of one channel with every matrix written out.
struct Dense {
  Eigen::MatrixXd a;      ///< n x k
  Eigen::MatrixXd r;      ///< covariance of the samples given the coefficients
  Eigen::MatrixXd noise;  ///< the stated noise's share of it
  Eigen::VectorXd scale;  ///< d x / d ln f
};

Dense dense(const samples::SampleSet& set, int channel) {
  const Basis& basis = test::full_basis();
  const BasisRows rows(basis);
  const auto n = static_cast<Eigen::Index>(set.samples.size());
  Dense found{Eigen::MatrixXd(n, basis.component_count()),
              {},
              Eigen::MatrixXd::Zero(n, n),
              Eigen::VectorXd(n)};
  Eigen::VectorXd common(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const samples::Sample& sample = set.samples[static_cast<std::size_t>(i)];
    const BasisRow row = rows.at(sample.direction);
    const double f = sample.value_per_sr[channel];
    const double slope = basis.mapping.derivative(f, row.weight);
    found.a.row(i) = row.q.transpose();
    found.scale[i] = slope * f;
    found.noise(i, i) = std::pow(slope * sample.sigma_per_sr[channel], 2);
    common[i] = slope * sample.u_common_per_sr[channel];
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) {
      const bool together = set.samples[static_cast<std::size_t>(i)].pose ==
                            set.samples[static_cast<std::size_t>(j)].pose;
      if (together) found.noise(i, j) += common[i] * common[j];
    }
  }
  const double model = ReconstructOptions().model_eta / static_cast<double>(basis.row_count());
  found.r = found.noise + model * Eigen::MatrixXd::Identity(n, n);
  return found;
}

/// Two poses of several directions each; what a pose shares is three times what it does not.
samples::SampleSet measured_in_two_poses() {
  samples::SampleSet set = measured(0.05);
  for (std::size_t i = 0; i < set.samples.size(); ++i) {
    samples::Sample& sample = set.samples[i];
    sample.u_common_per_sr = 0.15 * sample.value_per_sr;
    sample.pose = i < 4 ? 1 : 2;
  }
  return set;
}

TEST(Likeness, SeesATrainingMaterialLeftOutAsATrainingWithoutItDoes) {
  // A fixed offset common to the channels, with a prior of one neper, is one more rank-1 term of
  // the covariance of all three.
  const Basis& basis = test::full_basis();
  const double m = basis.row_count();
  const Eigen::Index k = basis.component_count();
  for (const bool noisy : {false, true}) {
    const samples::SampleSet set = noisy ? measured_in_two_poses() : measured(0.0);
    const auto n = static_cast<Eigen::Index>(set.samples.size());
    const double values = 3.0 * static_cast<double>(n);
    const auto block = [&](Eigen::MatrixXd& all, int c, const Eigen::MatrixXd& one) {
      all.block(c * n, c * n, n, n) = one;
    };
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(3 * n, 3 * n);
    Eigen::MatrixXd noise = covariance;
    Eigen::VectorXd scale(3 * n);
    for (int c = 0; c < 3; ++c) {
      const Dense one = dense(set, c);
      block(covariance, c, one.r + one.a * one.a.transpose() / m);
      block(noise, c, one.noise);
      scale.segment(c * n, n) = one.scale;
    }
    const double noise_share =
        (covariance + scale * scale.transpose()).llt().solve(noise).trace() / values;

    const Dense green = dense(set, 1);
    const Likeness likeness = fit(basis, set).likeness;
    ASSERT_EQ(likeness.left_out_innovation.size(), test::kMaterials);
    for (Eigen::Index t = 0; t < test::kMaterials; ++t) {
      const Eigen::MatrixXd own = basis.left_vectors.middleRows(3 * t, 3);
      const Eigen::MatrixXd rest =
          green.r + green.a * (Eigen::MatrixXd::Identity(k, k) - own.transpose() * own) *
                        green.a.transpose() / m;
      Eigen::VectorXd y(3 * n);
      Eigen::VectorXd offset(3 * n);
      covariance.setZero();
      for (int c = 0; c < 3; ++c) {
        block(covariance, c, rest);
        y.segment(c * n, n) = green.a * own.row(c).transpose();
        offset.segment(c * n, n) = green.scale;
      }
      const double innovation =
          y.dot((covariance + offset * offset.transpose()).llt().solve(y)) / values;
      EXPECT_NEAR(likeness.left_out_innovation[t], innovation + noise_share,
                  1e-5 * (innovation + noise_share))  // a singular R but for the model's share
          << "material " << t << (noisy ? ", noisy" : "");
    }
  }
}

TEST(Likeness, AddsToALeftOutChi2WhatNoiseLeavesInTheResiduals) {
  const Basis& basis = test::full_basis();
  const double m = basis.row_count();
  const samples::SampleSet set = measured_in_two_poses();
  const double values = 3.0 * static_cast<double>(set.samples.size());
  double noise = 0.0;
  for (int c = 0; c < 3; ++c) {
    const Dense one = dense(set, c);
    const Eigen::LLT<Eigen::MatrixXd> prior =
        Eigen::MatrixXd(one.r + one.a * one.a.transpose() / m).llt();
    // The residual of the linear solve is R S^-1 times the samples.
    const Eigen::MatrixXd residual = one.r * prior.solve(one.noise) * prior.solve(one.r);
    noise += one.r.llt().solve(residual).trace() / values;
  }
  const Dense green = dense(set, 1);
  const Fit found = fit(basis, set);
  for (Eigen::Index t = 0; t < test::kMaterials; ++t) {
    const Eigen::MatrixXd left =
        green.a * found.left_out_residuals.middleRows(3 * t, 3).transpose();
    const double expected = left.cwiseProduct(green.r.llt().solve(left)).sum() / values + noise;
    EXPECT_NEAR(found.likeness.left_out_chi2[t], expected, 1e-5 * expected) << "material " << t;
  }
}

TEST(Uncertainty, GrowsWithTheNoise) {
  const Basis& basis = test::full_basis();
  const Uncertainty noisy = uncertainty(basis, fit(basis, measured(0.3)));
  EXPECT_GT(noisy.sigma.mean(), 1.05F * clean_uncertainty().sigma.mean());
  EXPECT_GT(clean_uncertainty().factor_95, clean_uncertainty().factor_68);
  EXPECT_TRUE((clean_uncertainty().sigma.array() > 0.0F).all());
}

TEST(Uncertainty, IsTheErrorOfTheOnlyNeighboursLeft) {
  // With one material sharing all weight the band is that material's own left-out error.
  Fit fit = clean_fit();
  fit.likeness.distance.setConstant(-1.0);
  fit.likeness.distance.row(4).setConstant(0.0);
  for (Eigen::MatrixXd& noise : fit.noise_covariance) noise.setZero();
  const Uncertainty found = uncertainty(test::full_basis(), fit);
  const Eigen::VectorXf error =
      (test::full_basis().components.cast<double>() * fit.left_out_residuals.row(4).transpose())
          .cast<float>();
  // The floor of three thousandths, and single precision.
  EXPECT_LT((found.sigma.col(2) - error.cwiseAbs()).cwiseAbs().maxCoeff(), 0.0031F);
}

TEST(Uncertainty, GivesTheSameBytesWithOneAndTwoThreads) {
  parallel::set_thread_count(1);
  const Uncertainty one = uncertainty(test::full_basis(), clean_fit());
  parallel::set_thread_count(2);
  const Uncertainty two = uncertainty(test::full_basis(), clean_fit());
  parallel::set_thread_count(0);
  EXPECT_EQ(one.sigma, two.sigma);
  EXPECT_EQ(one.factor_95, two.factor_95);
}

TEST(Uncertainty, NeedsAFitThatLeftSomethingOut) {
  ReconstructOptions ridge;
  ridge.method = Method::ridge;
  EXPECT_THROW(uncertainty(test::full_basis(), fit(test::full_basis(), measured(0.0), ridge)),
               std::invalid_argument);
}

TEST(Uncertainty, LimitsEncloseTheResultAndAreNeverNegative) {
  const Basis& basis = test::full_basis();
  const brdf::BrdfTable middle = expand(basis, clean_fit().coefficients);
  const brdf::BrdfTable lower = limit(basis, clean_fit(), clean_uncertainty(), -2.0);
  const brdf::BrdfTable upper = limit(basis, clean_fit(), clean_uncertainty(), 2.0);
  for (const std::uint32_t cell : brdf::lattice::cells_above_horizon()) {
    if (cell % 1009 != 0) continue;
    EXPECT_TRUE((lower.value(cell) >= 0.0).all());
    EXPECT_TRUE((lower.value(cell) <= middle.value(cell)).all());
    EXPECT_TRUE((upper.value(cell) >= middle.value(cell)).all());
  }
}

TEST(UncertaintyFile, StandsBesideTheBinary) {
  EXPECT_EQ(uncertainty_path("a/found.binary"), "a/found.uncertainty.h5");
  EXPECT_EQ(uncertainty_path("a/found"), "a/found.uncertainty.h5");
  EXPECT_EQ(uncertainty_path("a.b/v1.2.dat"), "a.b/v1.2.dat.uncertainty.h5");
}

TEST(UncertaintyFile, HoldsTheLimitsOfEveryCellAndIsNotReplacedUnasked) {
  const TemporaryFolder folder;
  const Basis& basis = test::full_basis();
  const auto path = folder / "x.uncertainty.h5";
  write_uncertainty(path, basis, clean_fit(), clean_uncertainty(), kSha);
  const std::string bytes = bytes_of(path);
  EXPECT_THROW(write_uncertainty(path, basis, clean_fit(), clean_uncertainty(), kSha), FileError);
  EXPECT_EQ(bytes_of(path), bytes);
  write_uncertainty(path, basis, clean_fit(), clean_uncertainty(), kSha, files::Overwrite::Yes);
  EXPECT_EQ(bytes_of(path), bytes);

  const brdf::BrdfTable upper =
      limit(basis, clean_fit(), clean_uncertainty(), clean_uncertainty().factor_95);
  const std::size_t p = brdf::lattice::cells_above_horizon().size();
  std::vector<float> stored(3 * p);
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  ASSERT_GE(file, 0);
  const hid_t set = H5Dopen2(file, "upper_95", H5P_DEFAULT);
  ASSERT_GE(set, 0);
  EXPECT_GE(H5Dread(set, H5T_NATIVE_FLOAT, H5S_ALL, H5S_ALL, H5P_DEFAULT, stored.data()), 0);
  H5Dclose(set);
  EXPECT_GT(H5Aexists(file, "brdf_sha256"), 0);
  EXPECT_GT(H5Aexists(file, "radiometric_scale"), 0);
  H5Fclose(file);
  for (std::size_t i = 0; i < p; i += 4999) {
    const brdf::Rgb value = upper.value(brdf::lattice::cells_above_horizon()[i]);
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_FLOAT_EQ(stored[3 * i + c], static_cast<float>(value[static_cast<Eigen::Index>(c)]));
    }
  }
}

TEST(UncertaintyFile, TakesOnlyASumThatCanBeCompared) {
  const TemporaryFolder folder;
  for (const std::string& sum : {std::string(), std::string(63, 'a'), std::string(64, 'g'),
                                 std::string(64, 'A'), std::string(65, 'a')}) {
    EXPECT_THROW(write_uncertainty(folder / "x.uncertainty.h5", test::full_basis(), clean_fit(),
                                   clean_uncertainty(), sum),
                 std::invalid_argument)
        << sum;
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(UncertaintyFile, LeavesNothingBehindWhereItCannotBeWritten) {
  const TemporaryFolder folder;
  const auto path = folder / "missing" / "x.uncertainty.h5";
  EXPECT_THROW(write_uncertainty(path, test::full_basis(), clean_fit(), clean_uncertainty(), kSha),
               FileError);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(Uncertainty, RefusesABasisWhoseMaterialsAreAllSiblings) {
  Basis basis = test::full_basis();
  for (MaterialId& id : basis.materials) id.group = "one";
  const Fit found = fit(basis, test::sample(test::material(40), {half_diff_deg(3, 12, 28)}));
  EXPECT_THROW(uncertainty(basis, found), std::invalid_argument);
}

}  // namespace
}  // namespace gonio::basis
