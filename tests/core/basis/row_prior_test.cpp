#include "row_prior.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <string>
#include <vector>

#include "directions_deg.h"
#include "gonio/basis/siblings.h"
#include "kernel_solve.h"
#include "noise_model.h"
#include "test_materials.h"

namespace gonio::basis {
namespace {

/// Unlike any lobe: bands along theta_d and phi_d.
class Strange final : public brdf::BrdfModel {
 public:
  explicit Strange(double brightness) : brightness_(brightness) {}

 private:
  brdf::Rgb evaluate_visible(const brdf::ShadingGeometry& g) const override {
    const double bands =
        std::sin(5.0 * g.half_diff.theta_d.radians()) * std::cos(2.0 * g.half_diff.phi_d.radians());
    return brdf::Rgb::Constant(brightness_ * std::exp(3.0 * bands));
  }

  double brightness_;
};

constexpr int kLobes = 14;

/// Lobes and, last, twins that are unlike them.
Basis with_strange_twins(const std::string& group) {
  TrainingSet set(brdf::RadiometricScale::si);
  for (int i = 0; i < kLobes; ++i) {
    set.add({"lobe-" + std::to_string(i), "", ""}, test::material(i));
  }
  for (const double brightness : {0.1, 0.101}) {
    MaterialId id{"strange-" + std::to_string(brightness), "", ""};
    id.group = group;
    set.add(std::move(id), Strange(brightness));
  }
  return train(set, centred_gram(set));
}

detail::RowPrior prior_at_some_directions(const Basis& basis) {
  const samples::SampleSet set =
      test::sample(test::material(40), {half_diff_deg(3, 12, 28), half_diff_deg(30, 19, 89),
                                        half_diff_deg(5, 70, 77), half_diff_deg(15, 34, 130),
                                        half_diff_deg(1, 46, 37), half_diff_deg(0.3, 71, 104)});
  const detail::SampleRows rows = detail::look_up(BasisRows(basis), set, basis.component_count());
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(basis.component_count());
  return detail::heavy_tailed_prior(
      basis,
      detail::normal_equations(rows, detail::map_samples(basis, rows, set, 1, {}, none, {})));
}

TEST(HeavyTailedPrior, CountsWhatTheOthersDoNotExplainLess) {
  const detail::RowPrior prior = prior_at_some_directions(with_strange_twins("twins"));
  EXPECT_LT(prior.weight.tail(6).maxCoeff(), 0.3);
  EXPECT_GT(prior.weight.head(3 * kLobes).mean(), 0.8);
  EXPECT_GT(prior.weight.minCoeff(), 0.0);
  EXPECT_LE(prior.weight.maxCoeff(), 1.0);
  EXPECT_DOUBLE_EQ(prior.mass, prior.weight.sum());
}

TEST(HeavyTailedPrior, TwinsVouchForEachOtherUnlessTheyAreToldToBeSiblings) {
  const double told = prior_at_some_directions(with_strange_twins("twins")).weight.tail(6).mean();
  const double untold = prior_at_some_directions(with_strange_twins("")).weight.tail(6).mean();
  EXPECT_GT(untold, 2.0 * told);
}

TEST(HeavyTailedPrior, IsThePlainOneForAHandfulOfMaterials) {
  const Basis& basis = test::full_basis();
  const detail::RowPrior prior = prior_at_some_directions(basis);
  EXPECT_EQ(prior.weight, Eigen::VectorXd::Ones(basis.row_count()));
  EXPECT_EQ(prior.mean, Eigen::VectorXd::Zero(basis.component_count()));
}

/// Uneven weights over the rows of full_basis(), the mean that belongs to them.
detail::RowPrior uneven_prior(const Basis& basis) {
  detail::RowPrior prior;
  prior.weight = Eigen::VectorXd::LinSpaced(basis.row_count(), 0.2, 1.0);
  prior.mass = prior.weight.sum();
  prior.mean = basis.left_vectors.transpose() * prior.weight / prior.mass;
  return prior;
}

/// Equations of a few samples, and what they were made of.
struct Measured {
  detail::SampleRows rows;
  detail::MappedSamples mapped;
  detail::NormalEquations equations;
};

Measured measured(const Basis& basis) {
  const samples::SampleSet set =
      test::sample(test::material(40), {half_diff_deg(3, 12, 28), half_diff_deg(30, 19, 89),
                                        half_diff_deg(5, 70, 77), half_diff_deg(15, 34, 130)});
  Measured result;
  result.rows = detail::look_up(BasisRows(basis), set, basis.component_count());
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(basis.component_count());
  result.mapped = detail::map_samples(basis, result.rows, set, 1, {}, none, {});
  result.equations = detail::normal_equations(result.rows, result.mapped);
  return result;
}

TEST(LeftOutChi2, IsTheOneOfTheOtherRowsWrittenOut) {
  Basis basis = test::full_basis();
  basis.materials[1].group = "twins";
  basis.materials[4].group = "twins";
  const detail::RowPrior prior = uneven_prior(basis);
  const Measured seen = measured(basis);
  const auto groups = rows_of_groups(basis);
  const std::vector<double> chi2 = detail::left_out_chi2(basis, seen.equations, prior, groups);
  ASSERT_EQ(chi2.size(), 5u);
  const Eigen::MatrixXd& u = basis.left_vectors;
  for (std::size_t g = 0; g < groups.size(); ++g) {
    Eigen::VectorXd weight = prior.weight;
    weight(groups[g]).setZero();
    const Eigen::RowVectorXd mean = weight.transpose() * u / weight.sum();
    const Eigen::MatrixXd v = u.rowwise() - prior.mean.transpose();
    const Eigen::MatrixXd covariance = seen.rows.a *
                                           (v.transpose() * weight.asDiagonal() * v / prior.mass) *
                                           seen.rows.a.transpose() +
                                       Eigen::MatrixXd(seen.mapped.variance.asDiagonal());
    double expected = 0.0;
    for (const Eigen::Index row : groups[g]) {
      const Eigen::VectorXd y = seen.rows.a * (u.row(row) - mean).transpose();
      expected += y.dot(covariance.partialPivLu().solve(y));
    }
    expected /= static_cast<double>(groups[g].size());
    EXPECT_NEAR(chi2[g], expected, 1e-6 * expected) << g;
  }
}

TEST(KernelSolve, WithoutAKernelIsThePosteriorMeanOfAWeightedPrior) {
  const Basis& basis = test::full_basis();
  const detail::RowPrior prior = uneven_prior(basis);
  const Measured seen = measured(basis);
  const detail::KernelSolve solve(basis, prior, seen.equations, detail::KernelShape{});
  const Eigen::MatrixXd v = basis.left_vectors.rowwise() - prior.mean.transpose();
  const auto posterior_mean = [&](const Eigen::VectorXd& weight, const Eigen::VectorXd& x) {
    const Eigen::MatrixXd prior_a =
        (v.transpose() * weight.asDiagonal() * v / prior.mass) * seen.rows.a.transpose();
    const Eigen::MatrixXd covariance =
        seen.rows.a * prior_a + Eigen::MatrixXd(seen.mapped.variance.asDiagonal());
    return Eigen::VectorXd(prior.mean +
                           prior_a * covariance.partialPivLu().solve(x - seen.rows.a * prior.mean));
  };
  const Eigen::VectorXd expected = posterior_mean(prior.weight, seen.mapped.x - seen.rows.mean);
  EXPECT_LT((solve.coefficients(seen.equations) - expected).norm(), 1e-6 * expected.norm());

  const std::vector<Eigen::Index> group = {6, 7, 8, 12, 13, 14};
  const Eigen::MatrixXd left = solve.leave_out({group});
  Eigen::VectorXd others = prior.weight;
  others(group).setZero();
  for (const Eigen::Index row : group) {
    const Eigen::VectorXd own = basis.left_vectors.row(row).transpose();
    const Eigen::VectorXd residual = own - posterior_mean(others, seen.rows.a * own);
    EXPECT_LT((left.row(row).transpose() - residual).norm(), 1e-6 * own.norm());
  }
}

}  // namespace
}  // namespace gonio::basis
