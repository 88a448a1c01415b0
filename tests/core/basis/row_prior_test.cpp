#include "row_prior.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "directions_deg.h"
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

TEST(HeavyTailedPrior, CentresItsRows) {
  const Basis basis = with_strange_twins("twins");
  const detail::RowPrior prior = prior_at_some_directions(basis);
  const Eigen::MatrixXd v = basis.left_vectors.rowwise() - prior.mean.transpose();
  EXPECT_LT((v.transpose() * prior.weight).norm(), 1e-12);
}

}  // namespace
}  // namespace gonio::basis
